"""Measure writers of PNG on restored pages (`bench.png_writers`).

Of each, the processor time and the size, against `restore.formats.parsing.png`. Writers that are not installed
are left out: `pip install zlib-ng isal deflate imagecodecs` adds four, the first three behind this package's own
filter of rows.
"""

from __future__ import annotations

import argparse
import io
import statistics
import time
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import cv2
import numpy as np
from PIL import Image

from drivers.simulated import Curl, Figure, Text, shoot
from restore import Settings, restore
from restore.formats.parsing.png import filtered_rows, png_parts
from restore.scan import Bytes

REPEATS = 3
LEVELS = (1, 6)  # the fastest of zlib's and its default
Z_RLE = 3  # of zlib: strings of one byte
ROW = "{:<10}{:<26}{:>12}{:>12}"


def main() -> None:
    """Print a line for each page and writer."""
    parser = argparse.ArgumentParser(prog="python -m bench.png_writers", description=__doc__)
    parser.add_argument("--dpi", type=float, default=300.0)
    parser.add_argument("--seed", type=int, default=5)
    chosen = parser.parse_args()
    print(ROW.format("page", "writer", "time", "size"))
    for name, artwork in (("markers", None), ("text", Text()), ("figure", Figure())):
        page = restore(shoot(Curl(), artwork, seed=chosen.seed)[0], Settings(dpi=chosen.dpi)).image
        for writer, (seconds, size) in measured(writers(), page).items():
            print(ROW.format(name, writer, f"{seconds:.2f}", f"{size:.3f}"), flush=True)


def writers() -> dict[str, Callable[[Bytes], bytes]]:
    """Return the writers that are installed, ours first."""
    found: dict[str, Callable[[Bytes], bytes]] = {"restore.formats.parsing.png": lambda page: b"".join(png_parts(page))}
    for level in LEVELS:
        found[f"Pillow, level {level}"] = lambda page, level=level: _pillow(page, level)
        found[f"OpenCV, level {level}"] = lambda page, level=level: _opencv(page, level)
    for name, module, compress in (
        ("zlib-ng", "zlib_ng.zlib_ng", _runs),
        ("isal", "isal.isal_zlib", lambda isal, data: isal.compress(data, 1)),
        ("libdeflate", "deflate", lambda deflate, data: deflate.zlib_compress(data, 1)),
    ):
        if find_spec(module.split(".")[0]):
            found[f"our filter, {name}"] = lambda page, module=module, compress=compress: compress(
                import_module(module), _filtered(page)
            )
    if find_spec("imagecodecs"):
        found["imagecodecs, level 1"] = lambda page: import_module("imagecodecs").png_encode(page, level=1)
    return found


def _filtered(page: Bytes) -> bytes:
    return filtered_rows(page.reshape(len(page), -1), np.zeros(page[0].size, np.uint8)).tobytes()


def _runs(zlib: Any, data: bytes) -> bytes:
    packer = zlib.compressobj(6, zlib.DEFLATED, 15, 9, Z_RLE)
    return bytes(packer.compress(data) + packer.flush())


def _pillow(page: Bytes, level: int) -> bytes:
    out = io.BytesIO()
    Image.fromarray(page).save(out, "PNG", compress_level=level)
    return out.getvalue()


def _opencv(page: Bytes, level: int) -> bytes:
    options = [cv2.IMWRITE_PNG_COMPRESSION, level, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_DEFAULT]
    return cv2.imencode(".png", page, options)[1].tobytes()


def measured(chosen: Mapping[str, Callable[[Bytes], bytes]], page: Bytes) -> dict[str, tuple[float, float]]:
    """Return processor time and size of each writer to those of the first, medians of turns."""
    seconds: dict[str, list[float]] = {name: [] for name in chosen}
    sizes: dict[str, int] = {}
    page = np.ascontiguousarray(page)
    for _ in range(REPEATS + 1):
        for name, write in chosen.items():
            start = time.process_time()
            sizes[name] = len(write(page))
            seconds[name].append(time.process_time() - start)
    first = next(iter(chosen))
    taken = {name: statistics.median(of_one[1:]) for name, of_one in seconds.items()}
    return {name: (taken[name] / taken[first], sizes[name] / sizes[first]) for name in chosen}


if __name__ == "__main__":
    main()

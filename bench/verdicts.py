"""`python -m bench.verdicts`: the measures behind a verdict, of good shots and of shots with one fault each.

The limits of the presets stand between the two.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from bench.shift import page_scan
from restore import RangeScan, save_scan
from station.session.presets import Thresholds, load_preset
from station.session.stages import run_restore
from station.verdict.same_page import similarity

NAMES = [name for name in Thresholds.model_fields if name != "similarity"]


def main() -> int:
    """Print a row of the table for each shot, then how alike pages are. Returns 0."""
    parameters = load_preset("book").parameters()
    print("| shot | " + " | ".join(NAMES) + " |\n|" + "---|" * (len(NAMES) + 1), flush=True)
    fingerprints = dict[str, str]()
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, scan) in enumerate(_shots()):
            save_scan(scan, Path(folder) / f"{number}.scan")
            result = run_restore(Path(folder) / f"{number}.scan", parameters, Path(folder) / str(number)).result
            cells = [_cell(result["measures"][one]) for one in NAMES] if "measures" in result else [result["error"]]
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
            if "measures" in result:
                fingerprints[name] = result["measures"]["fingerprint"]
    for other in ("the same page again", "another page", "page three"):
        print(f"similarity of a good shot and {other}: {similarity(fingerprints['good'], fingerprints[other]):.2f}")
    return 0


def _shots() -> Iterator[tuple[str, RangeScan]]:
    good = page_scan(1)
    assert good.texture is not None
    yield "good", good
    moved = good.texture_xy + (1.5, 0.7)
    light = np.clip(good.texture * 0.8, 0, 255).astype(np.uint8)
    yield "the same page again", replace(good, texture=light, texture_xy=moved)
    yield "another page", page_scan(2)
    yield "page three", page_scan(3)
    for blur in (1.0, 2.0, 3.0):
        yield f"out of focus by {blur:g} px", replace(good, texture=cv2.GaussianBlur(good.texture, (0, 0), blur))
    yield "a fifth more light", replace(good, texture=np.clip(good.texture * 1.2, 0, 255).astype(np.uint8))
    yield "its left side at the edge of the picture", page_scan(1, cut=True)
    points = good.points.copy()
    points[15:25, 20:28] = np.nan
    yield "a dark stain of 8 × 10 samples", replace(good, points=points)


def _cell(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"


if __name__ == "__main__":
    sys.exit(main())

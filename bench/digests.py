"""Digests of all outputs: two versions of the sources give the same results where their lists are equal.

`python -m bench.digests OUT` runs the demo and one restoration for every option and every format of scan, with the
results in OUT, and prints a line for each file. Times, memory and paths in the reports do not count.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from station.cli import main as planish

SIMULATED = Path(__file__).parent.parent / "configs" / "simulated.toml"
EVERYTHING = ("--tiff", "--map", "--mesh", "--strain", "--frames", "--review", "--coverage")
RUNS: dict[str, tuple[str, ...]] = {
    "sticks": EVERYTHING,
    "springs": ("--method", "springs"),
    "conformal": ("--method", "conformal"),
    "applicable": ("--method", "applicable"),
    "many-points": ("--points", "5000", "--map"),
    "fine": ("--dpi", "300"),
    "without-light": ("--shading", "remove", "--inpaint", "3"),
}
VOLATILE = ("seconds", "peak_memory_mb", "scan", "texture", "files", "source", "provenance")


def main(arguments: list[str]) -> None:
    """Run everything into a folder and print the digests."""
    out = Path(arguments[0])
    out.mkdir(parents=True)
    _run("scan", "--config", str(SIMULATED), "-o", str(out / "demo"))
    scans = {"folder": out / "demo" / "page.scan"} | _other_formats(out)
    for name, options in RUNS.items():
        _run("restore", str(scans["folder"]), "-o", str(out / name), *options)
    for name, scan in scans.items():
        _run("restore", str(scan), "-o", str(out / f"from-{name}"), "--map", "--mesh")
    for path in sorted(out.rglob("*")):
        if path.is_file() and not path.is_relative_to(out / "scans"):
            print(f"{digest(path)}  {path.relative_to(out)}")


def digest(path: Path) -> str:
    """Of a picture its pixels, of a report what does not change from run to run, of anything else its bytes."""
    if path.suffix in (".png", ".tif"):
        return _sha(_pixels(path))
    if path.suffix == ".json":
        kept = {key: value for key, value in json.loads(path.read_text()).items() if key not in VOLATILE}
        return _sha(json.dumps(kept, sort_keys=True).encode())
    return _sha(re.sub(rb"\d{4}-\d{2}-\d{2}T[\d:.+]+", b"TIME", path.read_bytes()))


def _pixels(path: Path) -> bytes:
    if path.suffix == ".tif":
        import tifffile

        return bytes(tifffile.imread(path).tobytes())
    with Image.open(path) as picture:
        return bytes(np.asarray(picture).tobytes())


def _sha(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:24]


def _run(*arguments: str) -> None:
    code = planish([*arguments, "--json"])
    if code:
        sys.exit(f"planish {' '.join(arguments)} ended with {code}")


def _other_formats(out: Path) -> dict[str, Path]:
    """The demo's scan, written in the other formats that can be written."""
    from restore import RangeScan, SurfaceMesh, load_scan
    from restore.formats import write_abs, write_obj, write_ply, write_vrml, write_vvd
    from restore.mesh.triangulate import triangulate

    scan = load_scan(out / "demo" / "page.scan")
    assert isinstance(scan, RangeScan)
    mesh = triangulate(scan)
    writers: dict[str, tuple[Callable[[Any, Path], None], RangeScan | SurfaceMesh]] = {
        "abs": (write_abs, scan),
        "abs.gz": (write_abs, scan),
        "obj": (write_obj, mesh),
        "ply": (write_ply, mesh),
        "wrl": (write_vrml, scan),
        "vvd": (write_vvd, scan),
    }
    paths = {name: out / "scans" / name / f"page.{name}" for name in writers}
    for name, (write, what) in writers.items():
        paths[name].parent.mkdir(parents=True)
        write(what, paths[name])
    return paths


if __name__ == "__main__":
    main(sys.argv[1:])

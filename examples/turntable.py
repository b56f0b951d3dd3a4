"""Restore a page from several views on a turntable: `python examples/turntable.py board views page.png`.

Both folders hold scan folders that are named by the angle of the stage in degrees: `0.scan`, `90.scan` and so on. Those
of `board` show a flat board with ArUco markers of the dictionary 4×4, from which the axis of the stage is found.
"""

from __future__ import annotations

import sys
from pathlib import Path

from PIL import Image

from restore import RangeScan, Settings, fit_axis, load_scan, merge_views, restore


def main(board: Path, views: Path, page_path: Path) -> None:
    """Find the axis, merge the views about it, restore the page and write it."""
    # 1. The axis is the same for all pages, until the scanner or the stage is moved.
    fit = fit_axis(*turned_scans(board))
    print(f"the markers lie {fit.rms_mm:.2f} mm rms off a turn about the axis")

    # 2. One view is completed by the others: where the laser was in shadow, another view saw the paper.
    merged = merge_views(*turned_scans(views), fit.axis)
    for view in merged.views:
        print(f"{view.turn_deg:g}°: {view.filled} samples filled{view.refused and f', left out: {view.refused}'}")

    # 3. The merged scan is restored like any other.
    page = restore(merged.scan, Settings(points=300, dpi=100))
    Image.fromarray(page.image).save(page_path, dpi=(page.dpi, page.dpi))


def turned_scans(folder: Path) -> tuple[list[RangeScan], list[float]]:
    """The scans of a folder and the angle of each, degrees."""
    scans = {float(path.stem): load_scan(path) for path in folder.glob("*.scan")}
    turns = sorted(scans)
    return [scan for turn in turns if isinstance(scan := scans[turn], RangeScan)], turns


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))

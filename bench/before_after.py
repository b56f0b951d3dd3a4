"""`python -m bench.before_after [OUT]`: the README's picture, a page as the scanner saw it and restored."""

from __future__ import annotations

import sys
from pathlib import Path

from drivers.simulated import Pose, Text, Wave, shoot
from restore import Settings, restore
from station.images.png import encode_png
from station.pictures.panels import Panel, resize_to_fit, side_by_side

PICTURE = Path(__file__).parent.parent / "docs" / "images" / "before-after.png"
HEIGHT, WIDTH = 480, 640  # of a panel: the colour image as it is


def main(path: Path = PICTURE) -> None:
    """Draw it."""
    scan, _ = shoot(Wave(), Text(), seed=3, pose=Pose(tilt_deg=8.0, turn_deg=4.0))
    page = restore(scan, Settings(shading="remove"))
    assert scan.texture is not None
    width, height = page.report["page_mm"]
    panels = [
        Panel(scan.texture, "As the scanner saw it"),
        Panel(
            resize_to_fit(page.image, height=HEIGHT, width=WIDTH),
            "Restored",
            f"{width:.1f} × {height:.1f} mm, to scale",
        ),
    ]
    path.write_bytes(encode_png(side_by_side(panels)))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

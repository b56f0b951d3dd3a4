"""`python -m bench.first_page [FOLDER]`: images of docs/tutorials/first-page.md, drawn from one simulated page."""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np

from drivers.simulated import Binding, Pose, Text, shoot
from restore import Settings, restore
from restore.scan import Bytes
from station.images.png import encode_png
from station.pictures.panels import Panel, resize_to_fit, side_by_side
from station.pictures.strain import strain_picture

DOCS = Path(__file__).parent.parent / "docs" / "images"
HEIGHT, WIDTH = 250, 336  # of a panel: two fit beside each other in a browser
STRAIN_WIDTH = 470
CROP_MM, ZOOM_DPI = (60.0, 20.0), 160.0
DPIS = (55.0, 150.0)  # what the scanner's camera gives an A4 page, and what is asked for by default


def main(folder: Path = DOCS) -> None:
    """Draw them all."""
    scan, _ = shoot(Binding(), Text(), seed=3, pose=Pose(tilt_deg=6.0))
    pages = [restore(scan, Settings(dpi=dpi, shading="remove")) for dpi in DPIS]
    page = pages[-1]
    assert scan.texture is not None
    width, height = page.report["page_mm"]
    panels = [
        Panel(resize_to_fit(scan.texture, height=HEIGHT, width=WIDTH), "As the scanner saw it"),
        Panel(resize_to_fit(page.image, height=HEIGHT, width=WIDTH), "Restored", f"{width:.1f} × {height:.1f} mm"),
    ]
    (folder / "first-page.png").write_bytes(encode_png(side_by_side(panels)))
    strain = strain_picture(page)
    rows = round(strain.shape[0] * STRAIN_WIDTH / strain.shape[1])
    strain = cv2.resize(strain, (STRAIN_WIDTH, rows), interpolation=cv2.INTER_AREA)
    (folder / "first-page-strain.png").write_bytes(encode_png(np.asarray(strain, np.uint8)))
    ppi = f"the source has {page.report['sampling_ppi']:.0f} ppi"
    zooms = [Panel(_zoom(each.image, each.dpi), f"dpi = {each.dpi:g}", ppi) for each in pages]
    (folder / "first-page-ppi.png").write_bytes(encode_png(side_by_side(zooms)))


def _zoom(image: Bytes, dpi: float) -> Bytes:
    """A part of a page (h, w, 3) from its middle, CROP_MM large, its pixels enlarged to ZOOM_DPI."""
    cols, rows = (round(side / 25.4 * dpi) for side in CROP_MM)
    top, left = (image.shape[0] - rows) // 2, (image.shape[1] - cols) // 2
    size = tuple(round(side / 25.4 * ZOOM_DPI) for side in CROP_MM)
    return np.asarray(cv2.resize(image[top : top + rows, left : left + cols], size, interpolation=cv2.INTER_NEAREST))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

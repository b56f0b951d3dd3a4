"""Colour image, 3D view and restored page, for the operator.

They are arranged in a row after a scan.
"""

from __future__ import annotations

import numpy as np

from restore import CoverageClass, RestoredPage
from restore.scan import Bytes
from station.pictures.panels import Panel, resize_to_fit, side_by_side
from station.pictures.view import oblique_camera, render_mesh

# Red lines rising to the right where nothing was seen, violet ones falling where pixels were inpainted.
HATCHES = {CoverageClass.OCCLUDED: ((192, 48, 40), 1), CoverageClass.INPAINTED: ((96, 56, 168), -1)}
HATCH, LINE_FRACTION = 8, 0.3  # pixels of the review picture from line to line, and how much of it is line
HEIGHT, WIDTH = 720, 960  # pixels of a panel: the colour image's own shape, half as large again


def review(page: RestoredPage, colour: Bytes | None) -> Bytes:
    """Draw the review picture (h, w, 3) uint8 RGB.

    colour: (h, w, 3), the scanner's colour image, or None.
    """
    panels = [_mesh_panel(page), _page_panel(page)]
    if colour is not None:
        panels.insert(0, _colour_panel(colour))
    return side_by_side(panels)


def _colour_panel(colour: Bytes) -> Panel:
    rows, cols = colour.shape[:2]
    return Panel(resize_to_fit(colour, height=HEIGHT, width=WIDTH), "As the scanner saw it", f"{cols} × {rows} pixels")


def _mesh_panel(page: RestoredPage) -> Panel:
    mesh = page.flat
    picture = render_mesh(mesh, oblique_camera(mesh.vertices), height=HEIGHT, width=WIDTH)
    return Panel(picture, "As it was measured", f"{len(mesh.vertices)} points, {len(mesh.faces)} triangles")


def _page_panel(page: RestoredPage) -> Panel:
    width, height = page.report["page_mm"]
    text = f"{width:.1f} × {height:.1f} mm, {page.dpi:g} dpi, shading: {page.report['shading']}"
    return Panel(
        resize_to_fit(hatch_unseen(page), height=HEIGHT, width=WIDTH), "Restored", text + _unseen_fractions(page)
    )


def hatch_unseen(page: RestoredPage) -> Bytes:
    """Hatch the occluded and the inpainted pixels of a page.

    Returns (h, w, 3) uint8 RGB.
    """
    picture = page.image.copy()
    lines = round(max(picture.shape[0] / HEIGHT, picture.shape[1] / WIDTH, 1.0) * HATCH)
    rows, cols = np.indices(page.coverage.shape)
    for kind, (colour, across) in HATCHES.items():
        line = ((rows + across * cols) % lines < lines * LINE_FRACTION) & (page.coverage == kind)
        picture[line] = colour
    return picture


def _unseen_fractions(page: RestoredPage) -> str:
    fractions = {kind: float((page.coverage == kind).sum() / max((page.coverage > 0).sum(), 1)) for kind in HATCHES}
    return "".join(f", {kind.name.lower()}: {fraction:.1%}" for kind, fraction in fractions.items() if fraction > 0)

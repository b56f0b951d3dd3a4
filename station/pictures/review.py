"""Colour image, 3D view and restored page side by side: what the operator looks at after a scan."""

from __future__ import annotations

from restore.scan import Bytes, RestoredPage
from station.pictures.canvas import Panel, fit, side_by_side
from station.pictures.view import draw, oblique

HEIGHT, WIDTH = 720, 960  # pixels of a panel: the colour image's own shape, half as large again


def review(page: RestoredPage, colour: Bytes | None) -> Bytes:
    """The review picture (h, w, 3) uint8 RGB. colour (h, w, 3): what the scanner's camera saw, None if nothing."""
    panels = [_space(page), _flat(page)]
    if colour is not None:
        panels.insert(0, _seen(colour))
    return side_by_side(panels)


def _seen(colour: Bytes) -> Panel:
    rows, cols = colour.shape[:2]
    return Panel(fit(colour, height=HEIGHT, width=WIDTH), "As the scanner saw it", f"{cols} × {rows} pixels")


def _space(page: RestoredPage) -> Panel:
    mesh = page.flat
    picture = draw(mesh, oblique(mesh.vertices), height=HEIGHT, width=WIDTH)
    return Panel(picture, "As it was measured", f"{len(mesh.vertices)} points, {len(mesh.faces)} triangles")


def _flat(page: RestoredPage) -> Panel:
    width, height = page.report["page_mm"]
    text = f"{width:.1f} × {height:.1f} mm, {page.dpi:g} dpi, shading: {page.report['shading']}"
    return Panel(fit(page.image, height=HEIGHT, width=WIDTH), "Restored", text)

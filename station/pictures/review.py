"""Colour image, 3D view and restored page side by side: what the operator looks at after a scan."""

from __future__ import annotations

import numpy as np

from restore import Bytes, RestoredPage, Seen
from station.pictures.canvas import Panel, fit, side_by_side
from station.pictures.view import draw, oblique

# Red lines rising to the right where nothing was seen, violet ones falling where something was invented.
HATCHES = {Seen.HIDDEN: ((192, 48, 40), 1), Seen.INVENTED: ((96, 56, 168), -1)}
HATCH, LINE_SHARE = 8, 0.3  # pixels of the review picture from line to line, and how much of it is line
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
    return Panel(fit(hatched(page), height=HEIGHT, width=WIDTH), "Restored", text + _missing(page))


def hatched(page: RestoredPage) -> Bytes:
    """The page (h, w, 3) with hatches on what was not seen, and on what was invented there."""
    picture = page.image.copy()
    lines = round(max(picture.shape[0] / HEIGHT, picture.shape[1] / WIDTH, 1.0) * HATCH)
    rows, cols = np.indices(page.coverage.shape)
    for kind, (colour, across) in HATCHES.items():
        line = ((rows + across * cols) % lines < lines * LINE_SHARE) & (page.coverage == kind)
        picture[line] = colour
    return picture


def _missing(page: RestoredPage) -> str:
    shares = {kind: float((page.coverage == kind).sum() / max((page.coverage > 0).sum(), 1)) for kind in HATCHES}
    return "".join(f", {kind.name.lower()}: {share:.1%}" for kind, share in shares.items() if share > 0)

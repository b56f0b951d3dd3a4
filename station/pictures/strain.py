"""How much the flattening stretched the page, and where."""

from __future__ import annotations

from collections.abc import Sequence
from math import log10

import numpy as np

from restore.flatten.network import edges_of
from restore.scan import Bytes, FlatMesh, Floats, RestoredPage
from station.pictures.canvas import FAINT_INK, GAP, TITLE_SIZE, blank, write
from station.pictures.raster import rasterise

HEIGHT, WIDTH = 1000, 1000  # the page fits into this
BAR_WIDTH, LEGEND_WIDTH, LINE = 28, 260, 30
TICKS = 5
SHOWN = 99.0  # percentile of strain at the end of the scale: a single sliver must not hide the rest
STEPS = (1.0, 2.0, 5.0, 10.0)
# Compressed – true – stretched: blue to white to red, equally dark at both ends.
COLOURS = np.array([[28, 72, 140], [120, 168, 212], [244, 244, 242], [230, 150, 118], [165, 38, 42]], float)


def strain_picture(page: RestoredPage) -> Bytes:
    """The flat mesh coloured by relative change of edge length, with a scale and numbers: (h, w, 3) uint8 RGB."""
    strain = edge_strain(page.fine)
    limit = round_up(float(np.percentile(np.abs(strain), SHOWN)))
    map_ = _paint(page.fine, strain.mean(axis=1) / limit)
    sheet = blank(map_.shape[0] + 2 * GAP, map_.shape[1] + LEGEND_WIDTH + 3 * GAP)
    sheet[GAP : GAP + map_.shape[0], GAP : GAP + map_.shape[1]] = map_
    lines = (
        f"{len(page.fine.vertices)} points",
        f"rms {np.sqrt(np.mean(strain**2)) * 100:.3f} %",
        f"max {np.abs(strain).max() * 100:.2f} %",
    )
    return _legend(sheet, map_.shape[1] + 2 * GAP, limit, lines)


def edge_strain(mesh: FlatMesh) -> Floats:
    """(m, 3) flat length / length on the surface − 1, of the three edges of every triangle."""
    edges = edges_of(mesh.faces)
    strain = np.linalg.norm(mesh.flat[edges[:, 0]] - mesh.flat[edges[:, 1]], axis=1) / mesh.lengths - 1
    sides = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2), axis=2)
    count = len(mesh.flat)
    by_side: Floats = strain[np.searchsorted(edges[:, 0] * count + edges[:, 1], sides[..., 0] * count + sides[..., 1])]
    return by_side


def round_up(value: float) -> float:
    """The next of … 1, 2, 5, 10, 20 … × 10ⁿ that is not smaller: the end of a scale that people can read."""
    if value <= 0:
        return 1e-6  # a page without any strain: any scale shows it white
    power = 10.0 ** np.floor(log10(value))
    return float(next(step for step in STEPS if step * power >= value * (1 - 1e-12)) * power)


def _paint(mesh: FlatMesh, share: Floats) -> Bytes:
    low, high = mesh.flat.min(axis=0), mesh.flat.max(axis=0)
    scale = (np.array([WIDTH, HEIGHT]) / (high - low)).min()
    width, height = np.maximum(1, np.ceil((high - low) * scale)).astype(int)
    xy = np.column_stack([mesh.flat[:, 0] - low[0], high[1] - mesh.flat[:, 1]]) * scale - 0.5
    seen = rasterise(xy, np.ones(len(xy)), mesh.faces, height=height, width=width)
    picture = blank(height, width)
    picture[seen.covered] = _colour(share[seen.face[seen.covered]])
    return picture


def _colour(share: Floats) -> Bytes:
    anchors = np.linspace(-1, 1, len(COLOURS))
    return np.column_stack([np.interp(share, anchors, channel) for channel in COLOURS.T]).round().astype(np.uint8)


def _legend(sheet: Bytes, left: int, limit: float, lines: Sequence[str]) -> Bytes:
    sheet = write(sheet, "Edge strain", left, GAP, size=TITLE_SIZE)
    for i, line in enumerate(lines):
        sheet = write(sheet, line, left, GAP + 42 + LINE * i)
    top, bottom = GAP + 42 + LINE * (len(lines) + 1), sheet.shape[0] - GAP - LINE
    sheet[top:bottom, left : left + BAR_WIDTH] = _colour(np.linspace(1, -1, bottom - top))[:, None]
    for share in np.linspace(1, -1, TICKS):
        row = round(top + (1 - share) / 2 * (bottom - top)) - LINE // 2
        word = {1.0: "  stretched", -1.0: "  compressed"}.get(float(share), "")
        number = f"{share * limit * 100:+.3g}" if share else "0"
        sheet = write(sheet, f"{number} %{word}", left + BAR_WIDTH + 12, row, ink=FAINT_INK)
    return sheet

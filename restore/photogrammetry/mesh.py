"""The mesh of a surface within an outline."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import Delaunay, cKDTree

from restore.numerics.polygons import inside_polygon
from restore.photogrammetry.surfaces.page_surface import PageSurface
from restore.scan import Floats, Ints

VERTICES = 80_000  # a vertex to 0.9 mm of A4, a tenth of what a wave needs
CLEAR = 0.75  # steps: at more than √½ of a side from its ends, a vertex does not part them in Delaunay's triangles
ROWS = np.sqrt(3) / 2  # of a step, between the rows of a lattice of equal sides, which has one Delaunay triangulation
MIN_AREA = 1e-6  # of a step squared: three vertices of the outline on a line span nothing


def mesh_within(surface: PageSurface, outline: Floats) -> tuple[Floats, Ints, Floats]:
    """Mesh a surface within an outline (k, 2) mm, counter-clockwise.

    Its first vertices are the outline, its others a lattice. Returns vertices (n, 3) mm, faces (m, 3) and places (n, 2)
    mm.
    """
    step = float(np.sqrt(cv2.contourArea(outline.astype(np.float32)) / VERTICES / ROWS))
    border = _divided(outline, step)
    places = np.concatenate([border, _lattice_within(border, step)])
    faces = Delaunay(places).simplices.astype(np.int64)
    faces = faces[_areas(places[faces]) > MIN_AREA * step**2]
    between = np.flatnonzero((faces < len(border)).all(axis=1))
    outside = between[~inside_polygon(places[faces[between]].mean(axis=1), border)]
    faces = np.delete(faces, outside, axis=0)
    return surface.creased(places, faces), faces, places


def stretch(vertices: Floats, faces: Ints, corners: Floats) -> float:
    """Return the excess area of a surface over its flat page, relative.

    Paper keeps its area: a surface that is torn has more. Compared with the ratio that most faces have.
    vertices: (n, 3) mm.
    faces: (m, 3).
    corners: (m, 3, 2) mm, of the faces on the flat page.
    """
    areas, flat = _areas(vertices[faces]), _areas(corners)
    return float(areas.sum() / flat.sum() / np.median(areas / flat) - 1.0)


def _divided(outline: Floats, step: float) -> Floats:
    """Divide a closed outline (k, 2) into steps of at most `step`, (n, 2), with its corners."""
    ahead = np.roll(outline, -1, axis=0) - outline
    parts = np.maximum(np.ceil(np.linalg.norm(ahead, axis=1) / step).astype(int), 1)
    side = np.repeat(np.arange(len(outline)), parts)
    along = (np.arange(len(side)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[side]
    return outline[side] + along[:, None] * ahead[side]


def _lattice_within(border: Floats, step: float) -> Floats:
    """Return lattice places (n, 2) within a border (k, 2), clear of it."""
    low, high = border.min(axis=0), border.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0], high[0], step), np.arange(low[1], high[1], step * ROWS))
    x[1::2] += step / 2
    places = np.stack([x, y], axis=-1).reshape(-1, 2)
    distance, _ = cKDTree(border).query(places, distance_upper_bound=CLEAR * step)
    places = places[np.isinf(distance)]
    return places[inside_polygon(places, border)]


def _areas(corners: Floats) -> Floats:
    """Return the areas (m,) of faces with corners (m, 3, 2) or (m, 3, 3)."""
    a, b, c = np.moveaxis(np.pad(corners, [(0, 0), (0, 0), (0, 3 - corners.shape[2])]), 1, 0)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))

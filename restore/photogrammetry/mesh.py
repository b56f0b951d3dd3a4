"""The mesh of a surface within an outline."""

from __future__ import annotations

import cv2
import numpy as np

from restore.mesh.ordered_grid import grid_faces
from restore.numerics import TINY
from restore.photogrammetry.page import inside_polygon
from restore.photogrammetry.page_surface import PageSurface
from restore.scan import Floats, Ints

VERTICES = 80_000  # a vertex to 0.9 mm of A4, a tenth of what a wave needs


def mesh_within(surface: PageSurface, outline: Floats) -> tuple[Floats, Ints]:
    """Vertices (n, 3) mm and faces (m, 3) on a lattice within an outline (k, 2) mm, counter-clockwise.

    The last lattice line within an outline is half a step inside it on average: the outline is widened by as much.
    """
    step = float(np.sqrt(cv2.contourArea(outline.astype(np.float32)) / VERTICES))
    outline = _widened(outline, step / 2)
    bounds = zip(outline.min(axis=0), outline.max(axis=0), strict=True)
    x, y = (np.arange(low, high, step) for low, high in bounds)
    places = np.stack(np.meshgrid(x, y[::-1]), axis=-1).reshape(-1, 2)
    inside = inside_polygon(places, outline).reshape(len(y), len(x))
    faces = grid_faces(inside)
    return surface.creased(places[inside.ravel()], faces), faces


def stretch(vertices: Floats, faces: Ints) -> float:
    """Area of a lattice of vertices (n, 3) and faces (m, 3) over that of as many faces as most of them are, less 1.

    All faces of a lattice have one area on the page, and paper keeps it: a surface that is torn has more.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return float(areas.mean() / np.median(areas) - 1.0)


def _widened(outline: Floats, by: float) -> Floats:
    """(k, 2) the outline moved outwards."""
    along = np.roll(outline, -1, axis=0) - np.roll(outline, 1, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), TINY)
    return outline + by * along @ np.array([[0.0, -1.0], [1.0, 0.0]])

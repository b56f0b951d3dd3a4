"""Meshes of bent sheets: strips between rulings, the straight lines on them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drivers.simulated.scene.sheets.facets import WELD_MM, doubled_areas
from drivers.simulated.scene.sheets.sheet import PageSize, corners
from restore.scan import Floats, Ints

CELL_MM = 8.0  # strips are cut this often along their length: long slanting slivers are slow to cast rays at
PARALLEL = 1e-12  # a direction within this of an edge of the page never crosses it


def ruled_mesh(
    page_mm: PageSize, position: Callable[[Floats], Floats], cut: Callable[[Floats], Floats], step: float
) -> tuple[Floats, Ints]:
    """Return points (n, 2) mm and triangles (m, 3) of the page, exact along the rulings.

    position: parameter (…) of the ruling through points (…, 2).
    cut: the points (n, 2, 2) where rulings (n,) enter and leave the page, the next on the right.
    step: distance between rulings in units of the parameter; its multiples, zero among them, are
    rulings.
    """
    # With a ruling through every corner of the page, no corner lies between two of them.
    ends = position(corners(page_mm))
    inner = np.arange(np.ceil(ends.min() / step), np.floor(ends.max() / step) + 1) * step
    border = cut(np.unique(np.concatenate([inner, ends])))
    cells = int(np.ceil(np.hypot(*page_mm) / CELL_MM))
    fraction = np.linspace(0, 1, cells + 1)[:, None]
    points = (border[:, :1] * (1 - fraction) + border[:, 1:] * fraction).reshape(-1, 2)
    index = np.arange(len(points)).reshape(len(border), cells + 1)
    low_left, low_right, high_left, high_right = (
        i.ravel() for i in (index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:])
    )
    lower, upper = (low_left, low_right, high_right), (low_left, high_right, high_left)
    faces = np.concatenate([np.stack(lower, axis=1), np.stack(upper, axis=1)])
    return points, faces[doubled_areas(points[faces]) > WELD_MM**2]


def cross_border(page_mm: PageSize, points: Floats, along: Floats) -> Floats:
    """Return where lines enter and leave the page, (n, 2, 2).

    points: (n, 2).
    along: (n, 2), unit directions.
    """
    slanted = np.abs(along) > PARALLEL
    safe = np.where(slanted, along, 1.0)
    reach = np.asarray(page_mm) / 2
    first, second = (-reach - points) / safe, (reach - points) / safe
    enter = np.where(slanted, np.minimum(first, second), -np.inf).max(axis=1)
    leave = np.where(slanted, np.maximum(first, second), np.inf).min(axis=1)
    leave = np.maximum(leave, enter)  # a ruling through a corner alone may miss the page by rounding
    return points[:, None] + along[:, None] * np.stack([enter, leave], axis=1)[..., None]

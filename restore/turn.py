"""A restored page turned by right angles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from restore.scan import FlatMesh, RestoredPage


def turn_page(page: RestoredPage, degrees: int) -> RestoredPage:
    """The page turned clockwise by 0, 90, 180 or 270 degrees: its pictures, its maps and its flat meshes.

    The report says `turned_deg`, and the size of the turned page. Raises ValueError for another angle.
    """
    quarters, rest = divmod(degrees, 90)
    if rest or not 0 <= quarters < 4:
        raise ValueError(f"{degrees} degrees are no right angle from 0 to 270")
    if quarters == 0:
        return page
    pictures = ("image", "mask", "page_map", "master", "coverage", "page_source")
    turned: dict[str, Any] = {
        name: None if (value := getattr(page, name)) is None else np.ascontiguousarray(np.rot90(value, -quarters))
        for name in pictures
    }
    flat = _turn_mesh(page.flat, quarters)
    fine = flat if page.fine is page.flat else _turn_mesh(page.fine, quarters)
    size = list(page.report["page_mm"])[:: -1 if quarters % 2 else 1]
    return replace(page, flat=flat, fine=fine, report={**page.report, "page_mm": size, "turned_deg": degrees}, **turned)


def _turn_mesh(mesh: FlatMesh, quarters: int) -> FlatMesh:
    """The mesh with its flat positions turned clockwise about the origin, without rounding."""
    x, y = mesh.flat.T
    for _ in range(quarters):
        x, y = y, -x
    return replace(mesh, flat=np.column_stack([x, y]))

"""A restored page turned by right angles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from restore.page import FlatMesh, RestoredPage
from restore.runtime.arguments import checks_types
from restore.scan import Floats

RIGHT_ANGLES = (0, 90, 180, 270)


@checks_types
def rotate_page(page: RestoredPage, degrees: int) -> RestoredPage:
    """Rotate a page clockwise by 0, 90, 180 or 270 degrees.

    With its pictures, its maps and its flat meshes. The report has the size of the rotated page, and in `rotation_deg`
    how far it is rotated in all, if it is. Raises ValueError for another angle.

    The report has the size of the turned page, and in `rotation_deg` how far it is turned in all, if it is. Raises
    ValueError for another angle.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> [page.image.shape, rotate_page(page, 90).image.shape]
    [(59, 118, 3), (118, 59, 3)]
    """
    if degrees not in RIGHT_ANGLES:
        raise ValueError(f"{degrees!r} degrees are not a right angle from 0 to 270")
    quarters = int(degrees) // 90
    if quarters == 0:
        return page
    images = page.changed_images(lambda _, image: np.rot90(image, -quarters))
    meshes = page.changed_meshes(lambda mesh: _turn_mesh(mesh, quarters))
    return replace(page, report=_turn_report(page.report, quarters), **images, **meshes)


def _turn_report(report: Mapping[str, Any], quarters: int) -> dict[str, Any]:
    """Return the report of a rotated page.

    Its size, a place on it, and how far it is rotated in all.
    """
    turned = {**report, "page_mm": list(report["page_mm"])[:: -1 if quarters % 2 else 1]}
    strain = turned.get("strain", {})
    if place := strain.get("chord_strain", {}).get("max_difference_at_mm"):
        (x,), (y,) = _clockwise(np.array(place)[None], quarters).T
        chords = {**strain["chord_strain"], "max_difference_at_mm": [float(x), float(y)]}
        turned["strain"] = {**strain, "chord_strain": chords}
    in_all = (turned.pop("rotation_deg", 0) + 90 * quarters) % 360
    return {**turned, "rotation_deg": in_all} if in_all else turned


def _turn_mesh(mesh: FlatMesh, quarters: int) -> FlatMesh:
    return replace(mesh, flat=_clockwise(mesh.flat, quarters))


def _clockwise(flat: Floats, quarters: int) -> Floats:
    """Positions (n, 2) mm turned about the origin, without rounding."""
    x, y = flat.T
    for _ in range(quarters):
        x, y = y, -x
    return np.column_stack([x, y])

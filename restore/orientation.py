"""Turn a restored page by right angles, or mirror it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from restore.page import FlatMesh, RestoredPage
from restore.report import ChordStrainReport, Report
from restore.runtime.arguments import checks_types
from restore.scan import Floats

RIGHT_ANGLES = (0, 90, 180, 270)
MIRROR = np.array([-1.0, 1.0])


@checks_types
def rotate_page(page: RestoredPage, degrees: int) -> RestoredPage:
    """Rotate a page with its pictures, maps and meshes clockwise by 0, 90, 180 or 270°.

    The report has the size of the rotated page, and in `rotation_deg` how far it is rotated in all, if it is. Raises
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
    turned = page.changed_pictures(lambda _, image: np.rot90(image, -quarters))
    turned = turned.changed_meshes(lambda mesh: replace(mesh, flat=_clockwise(mesh.flat, quarters)))
    report = _with_place_moved(page.report, lambda place: _clockwise(place, quarters))
    in_all = (report.pop("rotation_deg", 0) + 90 * quarters) % 360
    report = {**report, "page_mm": list(report["page_mm"])[:: -1 if quarters % 2 else 1]}
    report = {**report, "rotation_deg": in_all} if in_all else report
    left, top, right, bottom = np.roll(page.trimmed, quarters).tolist()
    return replace(turned, report=report, trimmed=(left, top, right, bottom))


@checks_types
def mirror_page(page: RestoredPage) -> RestoredPage:
    """Mirror a page from left to right: its images, its maps and its flat meshes.

    It is needed for a page that was read from a mirrored file. The surface stays as it was measured, its faces seen
    from the other side. The report has `mirrored`, and no finding that the page may be mirrored. Mirrored twice, it is
    the page itself, but for that finding.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> mirror_page(page).report["mirrored"]
    True
    """
    mirrored = page.changed_pictures(lambda _, image: image[:, ::-1]).changed_meshes(_mirror_mesh)
    findings = tuple(one for one in page.findings if one.code != "mirrored")
    report: Report = {**_mirror_report(page.report), "findings": [one.as_json() for one in findings]}
    left, top, right, bottom = page.trimmed
    return replace(mirrored, report=report, findings=findings, trimmed=(right, top, left, bottom))


def _mirror_report(report: Report) -> Report:
    """Return the report of a mirrored page.

    A place on it, that it is mirrored, if it is, and how far it is rotated then.
    """
    mirrored = _with_place_moved(report, lambda place: place * MIRROR)
    if turned := mirrored.get("rotation_deg"):
        mirrored = {**mirrored, "rotation_deg": 360 - turned}
    return mirrored if mirrored.pop("mirrored", False) else {**mirrored, "mirrored": True}


def _mirror_mesh(mesh: FlatMesh) -> FlatMesh:
    """Return the mesh mirrored: flat positions, and the orientation of its faces."""
    return replace(mesh, flat=mesh.flat * MIRROR, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))


def _with_place_moved(report: Report, move: Callable[[Floats], Floats]) -> Report:
    """Return a copy of a report whose only place on the page is moved.

    move: of positions (n, 2) mm.
    """
    strain = report["strain"]
    chords = strain["chord_strain"]
    ((x, y),) = move(np.array(chords["max_difference_at_mm"])[None])
    moved: ChordStrainReport = {**chords, "max_difference_at_mm": [float(x), float(y)]}
    return {**report, "strain": {**strain, "chord_strain": moved}}


def _clockwise(flat: Floats, quarters: int) -> Floats:
    """Turn positions (n, 2) mm about the origin, without rounding."""
    x, y = flat.T
    for _ in range(quarters):
        x, y = y, -x
    return np.column_stack([x, y])

"""Mirrors a restored page from left to right.

It is needed for one that was read from a mirrored file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from restore.page import FlatMesh, RestoredPage
from restore.runtime.arguments import checks_types


@checks_types
def mirror_page(page: RestoredPage) -> RestoredPage:
    """The page mirrored from left to right: its images, its maps and its flat meshes.

    The surface stays as it was measured, its faces seen from the other side. The report has `mirrored`, and no
    finding that the page may be mirrored. Mirrored twice, it is the page itself, but for that finding.

    >>> corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    >>> page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    >>> mirror_page(page).report["mirrored"]
    True
    """
    images, meshes = page.changed_images(lambda _, image: image[:, ::-1]), page.changed_meshes(_mirror_mesh)
    findings = tuple(one for one in page.findings if one.code != "mirrored")
    report = {**_mirror_report(page.report), "findings": [one.as_json() for one in findings]}
    return replace(page, report=report, findings=findings, **images, **meshes)


def _mirror_report(report: Mapping[str, Any]) -> dict[str, Any]:
    """Return the report of a mirrored page.

    A place on it, that it is mirrored, if it is, and how far it is rotated then.
    """
    mirrored = dict(report)
    strain = mirrored.get("strain", {})
    if place := strain.get("chord_strain", {}).get("max_difference_at_mm"):
        chords = {**strain["chord_strain"], "max_difference_at_mm": [-place[0], place[1]]}
        mirrored["strain"] = {**strain, "chord_strain": chords}
    if turned := mirrored.get("rotation_deg"):
        mirrored["rotation_deg"] = 360 - turned
    return mirrored if mirrored.pop("mirrored", False) else {**mirrored, "mirrored": True}


def _mirror_mesh(mesh: FlatMesh) -> FlatMesh:
    """Return the mesh mirrored: flat positions and face orientation.

    The faces are (m, 3).
    """
    return replace(mesh, flat=mesh.flat * np.array([-1.0, 1.0]), faces=np.ascontiguousarray(mesh.faces[:, ::-1]))

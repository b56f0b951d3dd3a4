"""Edges with more than two faces: which of them are the sheet, and what stands on it."""

from __future__ import annotations

import numpy as np

from restore.findings import Finding
from restore.mesh.adjacency import Sides, components
from restore.mesh.clean import select
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.limits import TINY
from restore.scan import Floats, Ints


def without_fins(mesh: ValidMesh) -> tuple[ValidMesh, list[Finding]]:
    """Remove faces that stand on the sheet, and report them.

    They are joined to it along edges of more than two faces. Of the faces at such an edge the two that continue most
    smoothly are of one sheet. Of the sheets that meet there the largest is the page.
    """
    crossings = np.flatnonzero(mesh.topology.face_counts > 2)
    if not len(crossings):
        return mesh, []
    outward = _outward(mesh, crossings)
    smooth = np.array([_smoothest(mesh.topology.sides, edge, outward) for edge in crossings.tolist()])
    inner = mesh.topology.sides.first[:-1][mesh.topology.face_counts == 2]
    ordinary = np.stack([mesh.topology.sides.at[inner], mesh.topology.sides.at[inner + 1]], axis=1) // 3
    sheet = components(np.concatenate([ordinary, smooth]), len(mesh.faces))
    meeting = np.concatenate(
        [_faces_at(mesh.topology.sides, edge)[[[0, k]]] for edge in crossings.tolist() for k in _others(mesh, edge)]
    )
    group = components(np.concatenate([ordinary, smooth, meeting]), len(mesh.faces))
    areas = 0.5 * np.linalg.norm(mesh.normals, axis=1)
    sizes, of_sheet = np.bincount(sheet, areas), np.empty(sheet.max() + 1, np.int64)
    of_sheet[sheet] = group
    order = np.lexsort((sizes, of_sheet))
    largest = np.zeros(len(sizes), bool)
    largest[order[np.r_[of_sheet[order][1:] != of_sheet[order][:-1], True]]] = True
    kept = largest[sheet]
    findings, lost = list[Finding](), float(areas[~kept].sum())
    if not kept.all():
        findings.append(Finding.of("fins_cut", lost / float(areas.sum()), area_mm2=lost))
        mesh = validated(select(mesh, mesh.faces[kept]))
    if left := int((mesh.topology.face_counts > 2).sum()):
        findings.append(Finding.of("edges_unclear", count=left))
    return mesh, findings


def _faces_at(sides: Sides, edge: int) -> Ints:
    return sides.at[sides.first[edge] : sides.first[edge + 1]] // 3


def _others(mesh: ValidMesh, edge: int) -> range:
    return range(1, int(mesh.topology.sides.first[edge + 1] - mesh.topology.sides.first[edge]))


def _outward(mesh: ValidMesh, crossings: Ints) -> dict[int, Floats]:
    """By edge, the unit directions (k, 3) in which its faces leave it."""
    found = {}
    for edge in crossings:
        a, b = mesh.vertices[mesh.topology.sides.edges[edge]]
        way = (b - a) / max(float(np.linalg.norm(b - a)), TINY)
        out = (
            mesh.vertices[mesh.faces[_faces_at(mesh.topology.sides, edge)]].sum(axis=1) - a - b - a
        )  # the third corners
        out -= (out @ way)[:, None] * way
        found[int(edge)] = out / np.maximum(np.linalg.norm(out, axis=1), TINY)[:, None]
    return found


def _smoothest(sides: Sides, edge: int, outward: dict[int, Floats]) -> Ints:
    """Return the two faces (2,) that leave an edge most nearly oppositely."""
    out = outward[int(edge)]
    return _faces_at(sides, edge)[list(np.unravel_index(np.argmin(out @ out.T), (len(out), len(out))))]

"""Removes a strip of the page below an open book's upper page.

The strip is seen beyond the upper page's edge and is cut off at the step between them. A scanner has no samples on the
step, which it sees edge-on: the mesh bridges it by a single row of faces.
"""

from __future__ import annotations

import numpy as np

from restore.findings import Finding
from restore.mesh.adjacency import components
from restore.mesh.clean import select
from restore.mesh.measures import face_normals, vertex_normals
from restore.mesh.validate import ValidMesh, validated
from restore.numerics.limits import TINY
from restore.numerics.robust import MAJORITY
from restore.scan import Floats, Ints, Mask

CREASED = np.sqrt(0.5)  # cosine between the normals of faces at a step: 45° and more, at its top and at its foot
MAX_STRIP = 0.15  # of the surface: more is a page of its own, or a part of this one
MIN_STRIP = 0.002  # of it: less is noise, and no word


def without_page_below(mesh: ValidMesh) -> tuple[ValidMesh, list[Finding]]:
    """Return the mesh without strips lower than the page, and findings.

    They lie behind a step of one row of faces. The wall of a fold is a part of the page: a mesh that resolves it has
    vertices within it, and it is not cut.
    """
    bridges = _bridges(mesh)
    lengths = np.linalg.norm(mesh.normals, axis=1)
    if not bridges.any() or lengths[bridges].sum() > MAX_STRIP * lengths.sum():
        return mesh, []
    piece = _pieces_without(mesh, bridges)
    sizes = np.bincount(piece[~bridges], lengths[~bridges], minlength=piece.max() + 1) / lengths.sum()
    page, strips = int(sizes.argmax()), np.flatnonzero((sizes > MIN_STRIP) & (sizes < MAX_STRIP))
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[mesh.faces[~bridges]] = piece[~bridges][:, None]
    drops = {int(strip): _drop(mesh, mesh.faces[bridges], of_vertex, page, int(strip)) for strip in strips}
    below = [strip for strip, drop in drops.items() if drop > 0.0]
    if not below:
        return mesh, []
    cut = np.isin(of_vertex, below)[mesh.faces].any(axis=1)
    fraction, step = float(lengths[cut].sum() / lengths.sum()), max(drops[strip] for strip in below)
    return validated(select(mesh, mesh.faces[~cut])), [Finding.of("page_below", fraction, step_mm=step)]


def _bridges(mesh: ValidMesh) -> Mask:
    """Return the faces (m,) between two creases, each corner of which is on a crease."""
    sides, is_inner = mesh.topology.sides, mesh.topology.face_counts == 2
    first = sides.first[:-1][is_inner]
    one, other = sides.at[first] // 3, sides.at[first + 1] // 3
    unit = _unit(mesh.normals)
    creased = np.einsum("ij,ij->i", unit[one], unit[other]) < CREASED
    on_crease = np.zeros(len(mesh.vertices), bool)
    on_crease[sides.edges[is_inner][creased]] = True
    return np.asarray(on_crease[mesh.faces].all(axis=1))


def _pieces_without(mesh: ValidMesh, bridges: Mask) -> Ints:
    """Return the connected piece (m,) of each face without the bridges."""
    ends = mesh.faces[~bridges]
    edges = np.concatenate([ends[:, [0, 1]], ends[:, [1, 2]]])
    return components(edges, len(mesh.vertices))[mesh.faces[:, 0]]


def _drop(mesh: ValidMesh, bridges: Ints, of_vertex: Ints, page: int, strip: int) -> float:
    """Return by how many mm a strip is lower than the page.

    Measured beyond its bridges (k, 3), with both level there; 0 if it is not lower.
    """
    piece = of_vertex[bridges]
    across = bridges[(piece == page).any(axis=1) & (piece == strip).any(axis=1)]
    if not len(across):
        return 0.0
    tops, feet = (of_vertex[across] == which for which in (page, strip))
    above, below = (
        _unit(_means(_normals_of(mesh, of_vertex, which), across, chosen))
        for which, chosen in ((page, tops), (strip, feet))
    )
    way = _means(mesh.vertices, across, feet) - _means(mesh.vertices, across, tops)
    down = -np.einsum("ij,ij->i", way, above)
    walls = _unit(face_normals(mesh.vertices, across))
    steep = np.abs(np.einsum("ij,ij->i", walls, above)) < CREASED
    parallel = np.einsum("ij,ij->i", above, below) > CREASED
    return float(np.median(down)) if float((steep & parallel & (down > 0.0)).mean()) > MAJORITY else 0.0


def _unit(vectors: Floats) -> Floats:
    """Return vectors (k, 3) scaled to length 1, or 0."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1), TINY)[:, None])


def _normals_of(mesh: ValidMesh, of_vertex: Ints, piece: int) -> Floats:
    """Return vertex normals by the faces of one piece alone, (n, 3), 0 for other vertices."""
    return vertex_normals(mesh.vertices, mesh.faces[(of_vertex[mesh.faces] == piece).all(axis=1)])


def _means(values: Floats, faces: Ints, chosen: Mask) -> Floats:
    """Return the means (k, 3) of values over the chosen corners of faces.

    values: (n, 3).
    faces, chosen: (k, 3).
    """
    return np.asarray((values[faces] * chosen[..., None]).sum(axis=1) / np.maximum(chosen.sum(axis=1), 1)[:, None])

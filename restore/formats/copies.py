"""Faces that a file writes more than once: doubled, or on both sides of the sheet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from restore.findings import Finding
from restore.formats.mesh import PaintedMesh
from restore.scan import Ints, SurfaceMesh, with_findings

Hashes = NDArray[np.uint64]

# Steps of the finaliser of MurmurHash3 (Appleby, public domain): every bit of a key changes half of the hash's. Two
# different ones of a million get the same hash of 64 bits once in 10⁷ meshes.
FACTOR, SHIFT = np.uint64(0xFF51AFD7ED558CCD), np.uint64(33)
STEP = np.uint64(0x9E3779B97F4A7C15)  # between columns, so that (x, y) and (y, x) differ


def merge_copies(mesh: SurfaceMesh) -> SurfaceMesh:
    """The mesh with the first of all faces between the same three places, whichever way round they run.

    A finding counts the others. Vertices that no face uses any more are left out.
    """
    first = _first_of_equal(_hash_faces(mesh.faces, first_at_place(mesh)))
    kept = first == np.arange(len(first))
    if kept.all():
        return mesh
    used = np.unique(mesh.faces[kept])
    number = np.zeros(len(mesh.vertices), np.int64)
    number[used] = np.arange(len(used))
    colours = {"colours": mesh.colours[used]} if isinstance(mesh, PaintedMesh) and mesh.colours is not None else {}
    merged = replace(
        mesh,
        vertices=mesh.vertices[used],
        faces=number[mesh.faces[kept]],
        texcoords=None if mesh.texcoords is None else mesh.texcoords[used],
        **colours,
    )
    return with_findings(merged, Finding.of("copies_merged", count=np.count_nonzero(~kept)))


def first_at_place(mesh: SurfaceMesh) -> Ints:
    """(n,) the first of the vertices that lie where each one does."""
    return _first_of_equal(_hash_places(mesh))


def _hash_places(mesh: SurfaceMesh) -> Hashes:
    """(n,) hashes of the positions of the vertices."""
    hashes = np.zeros(len(mesh.vertices), np.uint64)
    for column in np.ascontiguousarray(mesh.vertices.T + 0.0).view(np.uint64):  # −0 becomes 0
        hashes = _mix(hashes + column + STEP)
    return hashes


def _hash_faces(faces: Ints, places: Ints) -> Hashes:
    """(m,) hashes of the places (n,) of the corners of faces (m, 3), in any order."""
    hashes: Hashes = _mix(places.astype(np.uint64) + STEP)[faces].sum(axis=1)
    return hashes


def _mix(keys: Hashes) -> Hashes:
    keys = (keys ^ (keys >> SHIFT)) * FACTOR
    return keys ^ (keys >> SHIFT)


def _first_of_equal(hashes: Hashes) -> Ints:
    """(k,) index of the first of the hashes (k,) that are equal to each."""
    ascending = np.sort(hashes)
    if (ascending[1:] != ascending[:-1]).all():
        return np.arange(len(hashes))
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    return first[inverse]

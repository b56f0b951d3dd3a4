"""Faces that a file writes more than once: doubled, or on both sides of the sheet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from restore.findings import Finding
from restore.formats.parsing.mesh import PaintedMesh
from restore.mesh.places import STEP, Hashes, first_at_place, first_of_equal, mix
from restore.scan import Ints, with_findings


def merge_copies(mesh: PaintedMesh) -> PaintedMesh:
    """Remove copies of faces between the same three places.

    The first is kept, whatever the orientation. A finding counts the others. Vertices that are no longer used are left
    out.
    """
    first = first_of_equal(_hash_faces(mesh.faces, first_at_place(mesh.vertices)))
    kept = first == np.arange(len(first))
    if kept.all():
        return mesh
    used = np.unique(mesh.faces[kept])
    number = np.zeros(len(mesh.vertices), np.int64)
    number[used] = np.arange(len(used))
    merged = replace(
        mesh,
        vertices=mesh.vertices[used],
        faces=number[mesh.faces[kept]],
        texcoords=None if mesh.texcoords is None else mesh.texcoords[used],
        colours=None if mesh.colours is None else mesh.colours[used],
    )
    return with_findings(merged, Finding.of("copies_merged", count=np.count_nonzero(~kept)))


def _hash_faces(faces: Ints, places: Ints) -> Hashes:
    """Return hashes (m,) of the places of the corners of faces in any order of the corners.

    faces: (m, 3).
    places: (n,).
    """
    hashes: Hashes = mix(places.astype(np.uint64) + STEP)[faces].sum(axis=1)
    return hashes

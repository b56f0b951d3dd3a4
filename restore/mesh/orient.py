"""Orients all faces of a mesh counter-clockwise on the printed side."""

from __future__ import annotations

import numpy as np

from restore.mesh.adjacency import Sides, components, sides_of
from restore.mesh.measures import signed_areas
from restore.scan import Floats, Ints, Mask


def orient(faces: Ints, texcoords: Floats | None = None, sides: Sides | None = None) -> Ints:
    """The faces (m, 3), those turned round that run against their neighbours.

    Of each connected piece the printed side is where its texture, texcoords (n, 2) pixels, is not mirrored; without
    texture, where most of its faces run counter-clockwise already. A one-sided piece stays as it is. sides are those of
    the faces when they are known already.
    """
    count, sides = len(faces), sides or sides_of(faces)
    votes = np.ones(count) if texcoords is None else -signed_areas(texcoords, faces)  # its pixels run downwards
    if votes.min() >= 0.0 and _agree(faces, sides):
        return faces
    # As it is and turned round, every face is there twice; those that agree over an edge are of one sheet.
    first, second, agree = _neighbours(faces, sides)
    other = np.where(agree, second, second + count)
    joined = np.stack([np.r_[first, first + count], np.r_[other, (other + count) % (2 * count)]], axis=1)
    sheet = components(joined, 2 * count)
    as_it_is, turned = sheet[:count], sheet[count:]
    score = np.bincount(sheet, np.r_[votes, -votes])
    # Where as many have either orientation, one of the two is chosen for the whole piece.
    better = (score[turned] > score[as_it_is]) | ((score[turned] == score[as_it_is]) & (turned < as_it_is))
    return np.where(better[:, None], faces[:, ::-1], faces)


def map_runs_back(faces: Ints, texcoords: Floats) -> bool:
    """Return whether most of the texture is mirrored to the faces.

    faces: (m, 3).
    texcoords: (n, 2) pixels.
    """
    areas = signed_areas(texcoords, faces)  # its pixels run downwards: negative is as it should be
    return bool(areas.sum() > 0.0)


def _forward(faces: Ints, sides: Sides) -> Mask:
    """Return whether each side runs from the smaller vertex to the larger.

    Returns (h,) bool, edge after edge.
    """
    forward: Mask = (faces < np.roll(faces, -1, axis=1)).ravel()
    return forward.take(sides.at)


def _agree(faces: Ints, sides: Sides) -> bool:
    """Whether no two faces run the same way along an edge."""
    counts = np.diff(sides.first)
    if counts.max(initial=0) > 2:  # of three sides two run the same way
        return False
    forward, shared = _forward(faces, sides), sides.first[:-1][counts == 2]
    return bool((forward[shared] != forward[shared + 1]).all())


def _neighbours(faces: Ints, sides: Sides) -> tuple[Ints, Ints, Mask]:
    """Return the two faces on every inner edge, and if they agree.

    Both are (b,); they agree where they have the same orientation, (b,) bool.
    """
    forward, inner = _forward(faces, sides), sides.first[:-1][np.diff(sides.first) == 2]
    return sides.at[inner] // 3, sides.at[inner + 1] // 3, forward[inner] != forward[inner + 1]

"""Make all faces of a mesh run the same way round, counter-clockwise on the printed side."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from restore.flatten.network import half_edges
from restore.scan import Floats, Ints
from restore.strain import signed_areas


def orient(faces: Ints, texcoords: Floats | None = None) -> Ints:
    """The faces (m, 3), those turned round that run against their neighbours.

    Of each connected piece the printed side is where its texture, texcoords (n, 2) pixels, is not mirrored; without
    texture, where most of its faces run counter-clockwise already. A one-sided piece stays as it is.
    """
    count = len(faces)
    votes = np.ones(count) if texcoords is None else -signed_areas(texcoords, faces)  # its pixels run downwards
    if (votes >= 0).all() and _agree(faces):
        return faces
    # As it is and turned round, every face is there twice; those that agree over an edge are of one sheet.
    first, second, agree = _neighbours(faces)
    other = np.where(agree, second, second + count)
    joined = coo_matrix(
        (np.ones(2 * len(first)), (np.r_[first, first + count], np.r_[other, (other + count) % (2 * count)])),
        shape=(2 * count, 2 * count),
    )
    _, sheet = connected_components(joined, directed=False)
    as_it_is, turned = sheet[:count], sheet[count:]
    score = np.bincount(sheet, np.r_[votes, -votes])
    return np.where((score[turned] > score[as_it_is])[:, None], faces[:, ::-1], faces)


def _agree(faces: Ints) -> bool:
    """Whether no two faces run the same way along an edge."""
    keys = np.sort((faces * (faces.max() + 1) + np.roll(faces, -1, axis=1)).ravel())
    return bool((keys[1:] != keys[:-1]).all())


def _neighbours(faces: Ints) -> tuple[Ints, Ints, np.ndarray]:
    """The two faces on every inner edge, (b,) and (b,), and whether they run the same way round."""
    ends, side, first = half_edges(faces)
    forward = faces.ravel()[side] == ends[:, 0]
    inner = first[:-1][np.diff(first) == 2]
    return side[inner] // 3, side[inner + 1] // 3, forward[inner] != forward[inner + 1]

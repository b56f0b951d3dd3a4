"""Whether a mesh can be a page at all: refuse one-sided surfaces and closed bands."""

from __future__ import annotations

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import Sides, components
from restore.mesh.measures import lengths_between, straight_lengths
from restore.scan import Floats, Ints


def refuse_unflattenable(vertices: Floats, faces: Ints, sides: Sides) -> None:
    """Raise BadInput for a mesh of vertices (n, 3) mm, faces (m, 3) that is one-sided or a band closed on itself.

    Only meshes without flaws are judged: no edge has more than two faces, and no border meets itself in a vertex.
    """
    counts = np.diff(sides.first)
    inner = np.flatnonzero(counts == 2)
    one, other = (faces.ravel()[sides.at[sides.first[inner] + k]] for k in (0, 1))  # where either side starts
    border = sides.edges[counts == 1]
    ends = np.bincount(border.ravel(), minlength=len(vertices))
    if counts.max() > 2 or (ends[np.unique(border)] != 2).any():
        return
    if (one == other).any():
        raise BadInput("the surface has one side only, as a Möbius strip has", "cut the page out of the mesh")
    loop = components(border, len(vertices))
    turning = np.bincount(loop, np.where(ends > 0, np.pi - _angles(vertices, faces, sides), 0.0))
    loops = np.unique(loop[np.unique(border)])
    # In a flat page the border turns by 2π, a hole by −2π; both borders of a band turn by nothing.
    euler = len(np.unique(faces)) - len(sides.edges) + len(faces)
    if len(loops) == 2 and euler == 0 and (np.abs(turning[loops]) < np.pi).all():
        raise BadInput("the surface is a band closed on itself", "cut it open where the page begins")


def _angles(vertices: Floats, faces: Ints, sides: Sides) -> Floats:
    """(n,) rad: the sum of the corner angles at every vertex."""
    lengths, total = straight_lengths(vertices, sides.edges), np.zeros(len(vertices))
    for k in range(3):
        a, b, c = (faces[:, (k + m) % 3] for m in range(3))
        right, left, far = (lengths_between(*pair, sides.edges, lengths) for pair in ((a, b), (a, c), (b, c)))
        cosine = (right**2 + left**2 - far**2) / np.maximum(2.0 * right * left, np.finfo(float).tiny)
        total += np.bincount(a, np.arccos(np.clip(cosine, -1.0, 1.0)), len(vertices))
    return total

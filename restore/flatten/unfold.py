"""Turn back the triangles that fell on their face.

Sticks alone cannot tell a corner of the border from its mirror image: all its lengths are right on either side. Inside
the page a triangle falls over where lengths contradict each other, mostly over a crease that its vertices missed.
"""

from __future__ import annotations

import numpy as np

from restore.align import border_of
from restore.scan import Floats, Ints
from restore.strain import signed_areas

AVERAGINGS = 10  # between two looks at what is still flipped
LOOKS = 12  # each may take in more of what is round a tangle


def unfold(flat: Floats, faces: Ints) -> int:
    """Mirror the loosest corner of every flipped face over its other two, in place; how many there were.

    flat (n, 2) mm, faces (m, 3) counter-clockwise on the page; the loosest corner is the one that fewest faces share.
    """
    flipped = np.flatnonzero(signed_areas(flat, faces) < 0.0)  # a face without area has no side to fall on
    shared = np.bincount(faces.ravel(), minlength=len(flat))
    turned = set()
    for face in faces[flipped]:
        apex = face[np.argmin(shared[face])]
        if apex in turned:  # two faces of one corner: mirrored twice it would be where it was
            continue
        turned.add(apex)
        start, end = flat[face[face != apex]]
        along = (end - start) / max(float(np.linalg.norm(end - start)), np.finfo(float).tiny)
        offset = flat[apex] - start
        flat[apex] = start + 2.0 * (offset @ along) * along - offset
    return len(flipped)


def untangle(flat: Floats, faces: Ints, edges: Ints) -> Floats:
    """Flat positions (n, 2) mm with fewer faces (m, 3) flipped: their corners go amid their neighbours.

    It costs the edges (e, 2) there their lengths, and is the last resort.
    """
    loose, inner = np.zeros(len(flat), bool), np.ones(len(flat), bool)
    inner[border_of(faces)] = False  # would be drawn in
    degree = np.bincount(edges.ravel(), minlength=len(flat))
    flat, start, end = flat.copy(), *edges.T
    for look in range(LOOKS):
        flipped = signed_areas(flat, faces) < 0.0
        if not flipped.any():
            break
        loose[faces[flipped]] = True
        if look > LOOKS // 2:
            inner[faces[flipped]] = True  # it hangs on the border: better drawn in than folded
        move = loose & inner
        for _ in range(AVERAGINGS):
            total = np.zeros_like(flat)
            np.add.at(total, start, flat[end])
            np.add.at(total, end, flat[start])
            flat[move] = total[move] / degree[move, None]
    return flat

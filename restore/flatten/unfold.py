"""Turn back the triangles that fell on their face at the border.

Sticks alone cannot tell a corner of the border from its mirror image: all its lengths are right on either side.
"""

from __future__ import annotations

import numpy as np

from restore.scan import Floats, Ints
from restore.strain import signed_areas


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

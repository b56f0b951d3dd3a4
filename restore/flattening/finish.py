"""Bring a page that lies nearly right to rest: its neighbours in order, nothing on its face, the least strain."""

from __future__ import annotations

from math import sqrt

import numpy as np

from restore.flattening.kernels import relax_in_plane
from restore.flattening.settle import STEPS, descend
from restore.flattening.unfold import unfold
from restore.mesh.measures import flipped_faces
from restore.mesh.network import spread
from restore.scan import Floats, Ints

SWEEPS = 10  # put neighbours in order; long slow bends are left to Newton's steps
SLOWING = 3.2  # the momentum 1 − SLOWING / √n carries a strain as long as the sheet out of it without swinging
LEAST_MOMENTUM = 0.5
HASTY = 2  # of Newton's steps between two looks at what lies on its face
LESS = 0.8  # of the squared strains is worth another step of a page with something on its face
UNFOLDINGS = 5  # each frees the corners that the last one still held


def finish(flat: Floats, faces: Ints, edges: Ints, lengths: Floats, only_in_order: bool = False) -> Floats:
    """Flat positions (n, 2) mm near by of least strain; edges (e, 2) have lengths (e,) mm. Corners are unfolded.

    As long as one of the faces (m, 3) lies on its face few of Newton's steps are taken: more would settle the page in
    its folds. With only_in_order a page that has such a face after the sweeps is left there, to be untangled first.
    """
    edges, lengths = spread(edges, lengths)
    flat, momentum = np.array(flat, order="C"), max(1.0 - SLOWING / sqrt(len(flat)), LEAST_MOMENTUM)
    relax_in_plane(flat, edges, lengths, SWEEPS, momentum)
    if only_in_order and flipped_faces(flat, faces):
        return flat
    descend(flat, edges, lengths, HASTY, 1.0)
    left = flipped_faces(flat, faces)
    for _ in range(UNFOLDINGS if left else 0):
        turned = flat.copy()
        if not unfold(turned, faces, edges):
            break
        relax_in_plane(turned, edges, lengths, SWEEPS, momentum)
        descend(turned, edges, lengths, HASTY, 1.0)
        if flipped_faces(turned, faces) >= left:  # what is still flipped does not lie at the border
            break
        flat, left = turned, flipped_faces(turned, faces)
    descend(flat, edges, lengths, STEPS, LESS if left else 1.0)
    return flat

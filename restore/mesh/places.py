"""Coincident vertices, found by hashes of their positions.

The time is linear in their number but for a sort of whole numbers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from restore.scan import Floats, Ints

Hashes = NDArray[np.uint64]

# Steps of the finaliser of MurmurHash3 (Appleby, public domain): every bit of a key changes half of the hash's. Two
# different ones of a million get the same hash of 64 bits once in 10⁷ meshes.
FACTOR, SHIFT = np.uint64(0xFF51AFD7ED558CCD), np.uint64(33)
STEP = np.uint64(0x9E3779B97F4A7C15)  # between columns, so that (x, y) and (y, x) differ
SAME_PIXELS = 1.0  # of the picture: vertices at one place that differ by less are in one chart


def first_at_place(vertices: Floats) -> Ints:
    """Return the first of the vertices (n, 3) at each one's position, (n,)."""
    hashes = np.zeros(len(vertices), np.uint64)
    for column in np.ascontiguousarray(vertices.T + 0.0).view(np.uint64):  # −0 becomes 0
        hashes = mix(hashes + column + STEP)
    return first_of_equal(hashes)


def first_in_chart(place: Ints, texcoords: Floats) -> Ints:
    """Return the first vertex at each one's place in the same chart.

    place: (n,), as from `first_at_place`.
    texcoords: (n, 2), close together within a chart.
    Returns (n,).
    """
    first, left = np.empty(len(place), np.int64), np.arange(len(place))
    leader = np.empty(len(place), np.int64)
    while len(left):  # once for each chart at the place that has most of them
        leader[place[left[::-1]]] = left[::-1]
        leads = leader[place[left]]
        near = (np.abs(texcoords[left] - texcoords[leads]) < SAME_PIXELS).all(axis=1)
        first[left[near]] = leads[near]
        left = left[~near]
    return first


def mix(keys: Hashes) -> Hashes:
    """Hashes of keys (n,)."""
    keys = (keys ^ (keys >> SHIFT)) * FACTOR
    return keys ^ (keys >> SHIFT)


def first_of_equal(hashes: Hashes) -> Ints:
    """Return the index (k,) of the first hash equal to each of hashes (k,)."""
    ascending = np.sort(hashes)
    if (ascending[1:] != ascending[:-1]).all():
        return np.arange(len(hashes))
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    return np.asarray(first[inverse])

"""Compiled inner loops of the particle system, in an interleaved order.

In that order no stick waits for the one before it. Run with `.py_func` the loops are the same in plain Python.
"""

from __future__ import annotations

from functools import lru_cache

import numba
import numpy as np

from restore.numerics.limits import SMALL
from restore.scan import Floats, Ints

GOLDEN = (5.0**0.5 - 1.0) / 2.0  # the golden section, whose multiples lie evenly over a list
BLOCK = 8192  # pairs of a quarter of a megabyte


@numba.njit(cache=True)
def advance(now: Floats, before: Floats, gravity: float, drag: float, damping: float, step: float) -> None:
    """Do one Verlet step (eq. 5), in place.

    now, before: (n, 3). drag pulls outward in x and y (eq. 4).
    """
    for i in range(len(now)):
        for axis in range(3):
            force = drag * now[i, axis] if axis < 2 else -gravity
            velocity = now[i, axis] - before[i, axis]
            before[i, axis] = now[i, axis]
            now[i, axis] += damping * velocity + force * step * step


@numba.njit(cache=True)
def relax(now: Floats, edges: Ints, lengths: Floats, hinges: Ints, spans: Floats, sweeps: int) -> None:
    """Project particles in place onto sticks, hinges and table.

    One after the other (eq. 3), `sweeps` times.
    now: (n, 3).
    edges: (e, 2), with lengths (e,) mm.
    hinges: (b, 2), with spans (b,) mm.
    """
    for _ in range(sweeps):
        _project(now, edges, lengths)
        _project(now, hinges, spans)
        for i in range(len(now)):
            now[i, 2] = max(now[i, 2], 0.0)


@numba.njit(cache=True)
def _project(now: Floats, pairs: Ints, lengths: Floats) -> None:
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        x, y, z = now[b, 0] - now[a, 0], now[b, 1] - now[a, 1], now[b, 2] - now[a, 2]
        distance = np.sqrt(x * x + y * y + z * z) + SMALL
        pull = 0.5 * (distance - lengths[k]) / distance
        now[a, 0] += pull * x
        now[a, 1] += pull * y
        now[a, 2] += pull * z
        now[b, 0] -= pull * x
        now[b, 1] -= pull * y
        now[b, 2] -= pull * z


def interleave(pairs: Ints, lengths: Floats) -> tuple[Ints, Floats]:
    """The same pairs (k, 2) and lengths (k,) in the order of `interleaved_order`."""
    order = interleaved_order(len(pairs))
    return pairs.take(order, axis=0), lengths.take(order)


def interleaved_order(count: int) -> Ints:
    """Return an order in which list neighbours are not sheet neighbours.

    Going over one pair then does not wait for the one before it, and the processor takes several at a time. Those of a
    block stay together, as it fits into the processor's cache. Returns (count,).
    """
    whole = count // BLOCK * BLOCK
    blocks = np.arange(0, whole, BLOCK)[:, None] + _strides(BLOCK)
    return np.concatenate([blocks.ravel(), whole + _strides(count - whole)])


@lru_cache(maxsize=16)
def _strides(count: int) -> Ints:
    """Return 0 to count − 1 in steps of about the golden section.

    They come back to the same place last.
    """
    stride = max(round(GOLDEN * count), 1)
    while np.gcd(stride, max(count, 1)) != 1:
        stride += 1
    return np.arange(count) * stride % max(count, 1)

"""The inner loops of the particle system, compiled. Run with `.py_func` they are the same in plain Python."""

from __future__ import annotations

import numba
import numpy as np

from restore.numerics.limits import SMALL
from restore.scan import Floats, Ints


@numba.njit(cache=True)
def advance(now: Floats, before: Floats, gravity: float, drag: float, damping: float, step: float) -> None:
    """One Verlet step (eq. 5), in place: now and before (n, 3); drag pulls outward in x and y (eq. 4)."""
    for i in range(len(now)):
        for axis in range(3):
            force = drag * now[i, axis] if axis < 2 else -gravity
            velocity = now[i, axis] - before[i, axis]
            before[i, axis] = now[i, axis]
            now[i, axis] += damping * velocity + force * step * step


@numba.njit(cache=True)
def relax(now: Floats, edges: Ints, lengths: Floats, hinges: Ints, spans: Floats, sweeps: int) -> None:
    """Project particles now (n, 3) in place onto sticks (eq. 3), hinges and table, one after the other, `sweeps` times.

    edges (e, 2) with lengths (e,) mm; hinges (b, 2) with spans (b,) mm.
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
        share = 0.5 * (distance - lengths[k]) / distance
        now[a, 0] += share * x
        now[a, 1] += share * y
        now[a, 2] += share * z
        now[b, 0] -= share * x
        now[b, 1] -= share * y
        now[b, 2] -= share * z

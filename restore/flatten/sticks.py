"""The stick-constraint particle system (Zhang, Zhang & Tan, TPAMI 2008, §3), made to end unstretched.

A particle at every vertex falls under gravity to the table while a drag pulls the sheet open. Verlet steps move the
particles; between two steps point relaxation puts every stick back to its length, every hinge back to flat and every
particle back over the table. Three things differ from the paper. The drag fades as the sheet sinks: a drag that never
stops leaves the sheet stretched. A little velocity is lost in each step, since projections feed energy in. And when
the sheet lies flat, relaxation goes on in the plane until the sticks stop changing.
"""

from __future__ import annotations

from collections.abc import Callable
from math import sqrt

import numpy as np

from restore.errors import BadInput
from restore.flatten.conformal import flatten_conformal
from restore.flatten.kernels import advance, area_of, relax, relax_in_plane
from restore.flatten.lay import Laid
from restore.flatten.network import Network
from restore.flatten.settle import settle
from restore.flatten.unfold import unfold
from restore.scan import Floats
from restore.strain import edge_strain, flipped_faces

GRAVITY = 9.81  # §3.3.3
DRAG = 0.2  # eq. 4; the paper's 0.05 leaves rolls of more than 90° folded, with fading four times as much is safe
TIME_STEP = 0.2  # s; the paper runs 0.1 and finds 0.32 the largest stable step
DAMPING = 0.95  # of the velocity is kept in each step
SWEEPS = 8  # of relaxation in each step: fewer leave sticks stretched, more cost time
MAX_STEPS = 400
AREA_CHANGE = 1e-5  # relative, the paper's ε
PAGE_SIZE = 240.0  # the constants above belong to a page of about this size; others are scaled to it
FLAT_HEIGHT = 1e-6  # mm: a sheet that rises less is flat already, and gets no drag
UNFOLDINGS = 5  # each frees the corners that the last one still held
PLANE_SWEEPS = 400
MAX_FALLING = 3000  # particles: with more, eight sweeps a step no longer carry a pull across the sheet
SOUND_STRAIN = 0.02  # rms; no paper stretches so far
CONFORMAL_ITERATIONS = 6  # of Newton: a conformal map of a curved sheet is some per cent off
PLANE_CHANGE = 1e-7  # of the page's size: one hundred-thousandth of a millimetre in a sweep

Follow = Callable[[int, Floats], None]


def flatten_sticks(laid: Laid, network: Network, follow: Follow | None = None) -> tuple[Floats, int]:
    """Flat positions (n, 2) mm of a sheet laid over the table, and the number of time steps taken.

    follow(step, positions (n, 3) mm) is called after each step. A sheet of many particles, or one of slivers that came
    down torn or folded, starts from its conformal map instead of falling, and has only its sticks put right.
    """
    falls = len(laid.positions) <= MAX_FALLING
    ways = (fall, _from_conformal) if falls else (_from_conformal, fall)
    found: list[tuple[int, float, int, Floats, int]] = []
    for way in ways:
        flat, steps = way(laid, network, follow)
        found.append((*_faults(flat, network), len(found), flat, steps))
        if found[-1][0] == 0 and found[-1][1] < SOUND_STRAIN:
            break
    *_, flat, steps = min(found, key=lambda fault: fault[:3])
    return flat, steps


def _faults(flat: Floats, network: Network) -> tuple[int, float]:
    """How many faces lie on their face, and the rms strain of the sticks."""
    flips = flipped_faces(flat, network.faces)
    strain = edge_strain(flat, network.edges, network.lengths)
    return flips, float(np.sqrt(np.mean(strain**2)))


def _from_conformal(laid: Laid, network: Network, follow: Follow | None) -> tuple[Floats, int]:
    """Flat positions (n, 2) mm from the conformal map; the sheet as the scanner saw it when it has no such map."""
    try:
        flat, steps = flatten_conformal(laid, network, follow)
    except BadInput:
        return laid.seen.copy(), 0
    for _ in range(UNFOLDINGS):
        flat = settle(flat, network.edges, network.lengths, CONFORMAL_ITERATIONS)
        if not unfold(flat, network.faces):
            break
    return flat, steps


def fall(laid: Laid, network: Network, follow: Follow | None) -> tuple[Floats, int]:
    """Let the particles fall on the table: flat positions (n, 2) mm and the time steps taken."""
    scale = PAGE_SIZE / sqrt(max(area_of(laid.positions, network.faces), np.finfo(float).tiny))
    lengths, spans = network.lengths * scale, network.spans * scale
    now = laid.positions * scale
    before = now.copy()
    start_height = max(float(now[:, 2].max()), FLAT_HEIGHT)
    area, step = 0.0, 0
    for step in range(1, MAX_STEPS + 1):
        drag = DRAG * max(float(now[:, 2].max()), 0.0) / start_height
        advance(now, before, GRAVITY, drag, DAMPING, TIME_STEP)
        relax(now, network.edges, lengths, network.hinges, spans, SWEEPS)
        if follow:
            follow(step, now / scale)
        previous, area = area, area_of(now[:, :2], network.faces)
        if abs(area - previous) < AREA_CHANGE * area:
            break
    flat = np.ascontiguousarray(now[:, :2])
    for _ in range(UNFOLDINGS):
        relax_in_plane(flat, network.edges, lengths, PLANE_SWEEPS, PLANE_CHANGE * PAGE_SIZE)
        if not unfold(flat, network.faces):
            break
    return flat / scale, step

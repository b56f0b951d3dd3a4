"""The stick-constraint particle system (Zhang, Zhang & Tan, TPAMI 2008, §3), made to end unstretched.

A particle at every vertex falls under gravity to the table while a drag pulls the sheet open. Verlet steps move the
particles; between two steps point relaxation puts every stick back to its length, every hinge back to flat and every
particle back over the table. Three things differ from the paper. The drag fades as the sheet sinks: a drag that never
stops leaves the sheet stretched. A little velocity is lost in each step, since projections feed energy in. And as soon
as the sheet has landed it is finished in the plane (`finish.py`): waiting for it to come to rest takes four times as
long and changes nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import sqrt

import numpy as np

from restore.errors import BadInput
from restore.flattening.coarse import Coarse, coarsen
from restore.flattening.conformal import flatten_conformal
from restore.flattening.finish import finish
from restore.flattening.kernels import advance, relax
from restore.flattening.unfold import untangle
from restore.mesh.measures import flipped_faces, rms_strain, surface_area
from restore.mesh.network import Network, spread
from restore.mesh.pose import Laid
from restore.scan import Floats

GRAVITY = 9.81  # §3.3.3
DRAG = 0.2  # eq. 4; the paper's 0.05 leaves rolls of more than 90° folded, with fading four times as much is safe
TIME_STEP = 0.2  # s; the paper runs 0.1 and finds 0.32 the largest stable step
DAMPING = 0.95  # of the velocity is kept in each step
MAX_STEPS = 400
AREA_CHANGE = 1e-5  # relative, the paper's ε
LANDED = 0.1  # of the height at the start: what still stands up is flattened by relaxation without a fold
PAGE_SIZE = 240.0  # the constants above belong to a page of about this size; others are scaled to it
FLAT_HEIGHT = 1e-6  # mm: a sheet that rises less is flat already, and gets no drag
SWEEPS = 0.25  # in each step, of √n: a pull crosses a sheet of n in √n sweeps; with half as many corners fold
UNTANGLINGS = 5  # each undoes what the one before it came upon
LESS = 0.9  # of the strain before is progress
SOUND_STRAIN = 0.03  # rms; no paper stretches so far

Follow = Callable[[int, Floats], None]
Start = Callable[[Laid, Network, Follow | None], tuple[Floats, int]]


def flatten_sticks(laid: Laid, network: Network, follow: Follow | None = None) -> tuple[Floats, int]:
    """Flat positions (n, 2) mm of a sheet laid over the table, and the number of time steps taken.

    follow(step, positions (n, 3) mm) is called after each step. Of a sheet of many particles few fall, and take the
    others with them. One that comes down torn or folded falls again with more of them; if that is no better it starts
    from its conformal map instead, and has only its sticks put right.
    """
    found: list[tuple[int, float, int, Floats, int]] = []
    whole: list[Start] = []
    rises = float(laid.positions[:, 2].max()) > FLAT_HEIGHT
    for start, most, cost in WAYS:
        few = coarsen(laid.positions, network, most) if rises and len(laid.positions) > most else None
        if few is None and start in whole:
            continue
        if few is None:
            whole.append(start)
        flat, steps = flatten_from(start, few, laid, network, follow)
        left, strain = _faults(flat, network)
        tangled = strain
        if left:
            flat, tangled = _untangled(flat, network)
            left, strain = _faults(flat, network)
        found.append((left, strain, len(found), flat, steps))
        if left == 0 and strain < SOUND_STRAIN and strain <= cost * tangled:
            break
    *_, flat, steps = min(found, key=lambda fault: fault[:3])
    return flat, steps


def _untangled(flat: Floats, network: Network) -> tuple[Floats, float]:
    """Flat positions (n, 2) mm with nothing on its face, if that can be, and the strain of the page that still has it.

    Most tangles are gone for good when they have been undone; in others the sticks contradict each other, and undoing
    them strains the page. It goes on while either strain becomes less.
    """
    mesh = network.faces, network.edges, network.lengths
    flat, tangled, before = untangle(flat, *mesh), np.inf, np.inf
    for _ in range(UNTANGLINGS):
        settled = finish(flat, *mesh)
        left, tangled = _faults(settled, network)
        if left == 0:
            return settled, tangled
        flat = untangle(settled, *mesh)
        if _faults(flat, network)[1] > tangled > LESS * before:
            break
        before = tangled
    return flat, tangled


def _faults(flat: Floats, network: Network) -> tuple[int, float]:
    """How many faces lie on their face, and the rms strain of the sticks."""
    return flipped_faces(flat, network.faces), rms_strain(flat, network.edges, network.lengths, np.inf)


def flatten_from(
    start: Start, few: Coarse | None, laid: Laid, network: Network, follow: Follow | None
) -> tuple[Floats, int]:
    """Flat positions (n, 2) mm from where `start` has the particles, or a few of them, and the others go along."""
    if few is None:
        flat, steps = start(laid, network, follow)
        return finish(flat, network.faces, network.edges, network.lengths), steps

    lifted = (lambda step, positions: follow(step, few.carry(laid.positions, positions))) if follow else None
    seen = replace(laid, positions=laid.positions[few.index], seen=laid.seen[few.index])
    flat, steps = start(seen, few.network, lifted)
    flat = finish(flat, few.network.faces, few.network.edges, few.network.lengths)
    flat = few.carry(laid.positions, flat)
    return finish(flat, network.faces, network.edges, network.lengths, only_in_order=True), steps


def _conformal(laid: Laid, network: Network, follow: Follow | None) -> tuple[Floats, int]:
    """Flat positions (n, 2) mm of the conformal map; the sheet as the scanner saw it when it has no such map."""
    try:
        return flatten_conformal(laid, network, follow)
    except BadInput:
        return laid.seen.copy(), 0


def fall(laid: Laid, network: Network, follow: Follow | None) -> tuple[Floats, int]:
    """Let the particles fall on the table: positions (n, 2) mm where they land, and the time steps taken."""
    scale = PAGE_SIZE / sqrt(max(surface_area(laid.positions, network.faces), np.finfo(float).tiny))
    edges, lengths = spread(network.edges, network.lengths * scale)
    hinges, spans = spread(network.hinges, network.spans * scale)
    now = laid.positions * scale
    before = now.copy()
    sweeps = round(max(SWEEPS * sqrt(len(now)), 1.0))
    height, area, step = float(now[:, 2].max()), 0.0, 0
    start = max(height, FLAT_HEIGHT)
    for step in range(1, MAX_STEPS + 1):
        advance(now, before, GRAVITY, DRAG * height / start, DAMPING, TIME_STEP)
        relax(now, edges, lengths, hinges, spans, sweeps)
        if follow:
            follow(step, now / scale)
        height = float(now[:, 2].max())
        previous, area = area, surface_area(now[:, :2], network.faces)
        if height < LANDED * start or abs(area - previous) < AREA_CHANGE * area:
            break
    return now[:, :2] / scale, step


# How to begin, with how many particles at most, and by how much untangling may raise the strain. Where lengths
# contradict each other, over creases that the points missed, faces fall over and that costs little; undoing a fold
# costs more.
WAYS: tuple[tuple[Start, int, float], ...] = (
    (fall, 600, 1.45),
    (fall, 6_000, 1.5),
    (_conformal, 6_000, np.inf),
)

"""Stick-constraint particle system, made to end unstretched.

Source: Zhang, Zhang & Tan, TPAMI 2008, §3.
A particle at every vertex falls under gravity to the table while a drag pulls the sheet open. Verlet steps move the
particles; between two steps point relaxation puts every stick back to its length, every hinge back to flat and every
particle back over the table. Three things differ from the paper. The drag fades as the sheet sinks: a drag that never
stops leaves the sheet stretched. A little velocity is lost in each step, since projections feed energy in. And as soon
as the sheet has landed Gauss–Newton takes over in the plane: waiting for it to come to rest takes four times as long
and changes nothing.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from restore.errors import BadInput
from restore.flattening.isometric.page import least_strain_page
from restore.flattening.published.hinges import hinges_of
from restore.flattening.published.stick_kernels import advance, interleave, relax
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import face_signs, surface_area
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
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


def flatten_sticks(
    posed: PosedSheet, network: Network, follow: Follow | None = None, *, bending: bool = True
) -> Solution:
    """Flatten a sheet by the stick-constraint particle system.

    follow: called as follow(step, positions (n, 3) mm) after each time step.
    bending: whether the hinges resist.
    Returns flat positions (n, 2) mm; the iterations are the time steps. Raises BadInput when lengths that are far from
    the sheet's own make the particles diverge.
    """
    landed, steps = simulate_drop(posed, network, follow, bending)
    signs = face_signs(posed.positions, network.faces)
    return least_strain_page(landed, network, signs)._replace(iterations=steps)


def simulate_drop(posed: PosedSheet, network: Network, follow: Follow | None, bending: bool) -> tuple[Floats, int]:
    """Return the positions of the particles on the table, and the steps taken.

    The positions are (n, 2) mm, the steps time steps.
    """
    scale = PAGE_SIZE / sqrt(max(surface_area(posed.positions, network.faces), np.finfo(float).tiny))
    edges, lengths = interleave(network.edges, network.lengths * scale)
    hinges, spans = hinges_of(network, bending)
    hinges, spans = interleave(hinges, spans * scale)
    now = posed.positions * scale
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
        if not np.isfinite(area):
            raise BadInput(f"the sticks of the sheet diverge in step {step}", "use the method isometric")
        if height < LANDED * start or abs(area - previous) < AREA_CHANGE * area:
            break
    return now[:, :2] / scale, step

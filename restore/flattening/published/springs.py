"""Mass-spring particle system that lets the sheet fall onto the table.

Source: Brown & Seales, "Image restoration of arbitrarily warped documents", TPAMI 2004.
A unit mass at every vertex falls under gravity to the table. Damped springs along the edges keep the sheet from
stretching, springs over the hinges keep it from shearing and folding. Explicit Euler steps move the particles; one that
goes through the table loses the normal part of its velocity and keeps the tangential part. Nothing stretches the sheet
at rest, so that it ends unstretched wherever it came to lie without folds. But nothing pulls it open either:
rolls whose ends stand past upright collapse.
"""

from __future__ import annotations

from math import sqrt

import numba
import numpy as np

from restore.errors import BadInput
from restore.flattening.published.hinges import hinges_of
from restore.flattening.solution import Follow, Solution
from restore.mesh.measures import edge_strain, surface_area
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
from restore.numerics.limits import SMALL
from restore.scan import Floats, Ints

GRAVITY = 9.81
TIME_STEP = 0.02  # s; the largest stable step that Zhang, Zhang & Tan (TPAMI 2008, §4.2) report for this method
# Explicit Euler is stable for steps below damping / stiffness and below 2 / (damping × μ), where μ, the largest
# eigenvalue of the network, is about 20 for irregular meshes. Both allow 0.03 s here. Softer springs are not closer to
# rest after as many steps, stiffer ones diverge earlier.
STIFFNESS = 120.0  # 1/s², force on a unit mass per unit of length
DAMPING = 3.6  # 1/s, along the spring
BENDING = 0.3  # stiffness and damping of the springs over hinges, as a fraction of those along edges
DRAG = 1.5  # 1/s, resists all motion: dampers along the springs leave bending and turning undamped
PAGE_SIZE = 240.0  # the constants above belong to a page of about this size; others are scaled to it
FLAT_HEIGHT = 1e-3  # of the page's size: a sheet that rises less lies flat
AREA_CHANGE = 1e-7  # relative, in one step; at ten times as much the springs still swing by up to 0.1 mm
QUIET_STEPS = 25  # with no more change than that; a swinging sheet stands still for a moment at every turn
MAX_STEPS = 5000


def flatten_springs(
    posed: PosedSheet, network: Network, follow: Follow | None = None, *, bending: bool = True
) -> Solution:
    """Flatten a sheet by the mass-spring system.

    follow: called as follow(step, positions (n, 3) mm) after each step.
    bending: whether springs span the hinges.
    Returns flat positions (n, 2) mm; iterations are time steps, the residual the rms strain. Raises BadInput when the
    springs diverge, as they may where very many edges meet.
    """
    scale = PAGE_SIZE / sqrt(max(surface_area(posed.positions, network.faces), np.finfo(float).tiny))
    hinges, spans = hinges_of(network, bending)
    lengths, spans = network.lengths * scale, spans * scale
    now = posed.positions * scale
    velocity, force = np.zeros_like(now), np.empty_like(now)
    area, quiet, step = 0.0, 0, 0
    for step in range(1, MAX_STEPS + 1):
        springs(now, velocity, force, network.edges, lengths, hinges, spans, STIFFNESS, DAMPING, BENDING)
        advance(now, velocity, force, GRAVITY, DRAG, TIME_STEP)
        if follow:
            follow(step, now / scale)
        previous, area = area, surface_area(now, network.faces)
        still = abs(area - previous) < AREA_CHANGE * area and now[:, 2].max() < FLAT_HEIGHT * PAGE_SIZE
        quiet = quiet + 1 if still else 0
        if not np.isfinite(area):
            raise BadInput(f"the springs of the sheet diverge in step {step}", "use the method isometric")
        if quiet == QUIET_STEPS:
            break
    residual = float(np.sqrt((edge_strain(now[:, :2], network.edges, lengths) ** 2).mean()))
    return Solution(now[:, :2] / scale, step, residual, quiet == QUIET_STEPS)


@numba.njit(cache=True)
def springs(
    now: Floats,
    velocity: Floats,
    force: Floats,
    edges: Ints,
    lengths: Floats,
    hinges: Ints,
    spans: Floats,
    stiffness: float,
    damping: float,
    bending: float,
) -> None:
    """Fill force (n, 3) with the pull of all springs.

    now: (n, 3), positions of the particles.
    velocity: (n, 3).
    """
    force[:] = 0.0
    _pull(now, velocity, force, edges, lengths, stiffness, damping)
    _pull(now, velocity, force, hinges, spans, bending * stiffness, bending * damping)


@numba.njit(cache=True)
def _pull(
    now: Floats, velocity: Floats, force: Floats, pairs: Ints, lengths: Floats, stiffness: float, damping: float
) -> None:
    for k in range(len(pairs)):
        a, b = pairs[k, 0], pairs[k, 1]
        x, y, z = now[b, 0] - now[a, 0], now[b, 1] - now[a, 1], now[b, 2] - now[a, 2]
        distance = np.sqrt(x * x + y * y + z * z) + SMALL
        x, y, z = x / distance, y / distance, z / distance
        parting = (
            (velocity[b, 0] - velocity[a, 0]) * x
            + (velocity[b, 1] - velocity[a, 1]) * y
            + (velocity[b, 2] - velocity[a, 2]) * z
        )
        pull = stiffness * (distance - lengths[k]) + damping * parting
        force[a, 0] += pull * x
        force[a, 1] += pull * y
        force[a, 2] += pull * z
        force[b, 0] -= pull * x
        force[b, 1] -= pull * y
        force[b, 2] -= pull * z


@numba.njit(cache=True)
def advance(now: Floats, velocity: Floats, force: Floats, gravity: float, drag: float, step: float) -> None:
    """Do one explicit Euler step in place, by the old velocities and forces, all (n, 3)."""
    for i in range(len(now)):
        for axis in range(3):
            now[i, axis] += step * velocity[i, axis]
            velocity[i, axis] += step * (force[i, axis] - drag * velocity[i, axis])
        velocity[i, 2] -= step * gravity
        if now[i, 2] < 0.0:
            now[i, 2] = 0.0
            if velocity[i, 2] < 0.0:
                velocity[i, 2] = 0.0

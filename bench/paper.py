"""The tables of the paper (Zhang, Zhang & Tan, TPAMI 2008, §4.2), run again: sticks against springs, and what helps.

Both are measured as particle systems of which every particle falls on the table; the sticks end with Gauss–Newton in
the plane. The default method, `isometric`, and Pilu's applicable surface, which the paper cites, stand in columns of
their own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any
from unittest import mock

import numpy as np

from bench.timing import REPEATS, in_turns, median_seconds
from drivers.simulated.scene.sheets import Binding, Cone, Crumpled, Curl, Miura, MultiFold, Sheet, Spread, Wave
from oracles.exact import ExactSheet, exact_sheet
from oracles.markers import rigid_residual
from restore.errors import BadInput
from restore.flattening.isometric.page import flatten_isometric
from restore.flattening.published import springs, sticks
from restore.flattening.published.applicable import flatten_applicable
from restore.flattening.published.springs import flatten_springs
from restore.flattening.published.sticks import flatten_sticks
from restore.flattening.solution import Solution
from restore.mesh.measures import edge_strain, flipped_faces
from restore.mesh.network import Network
from restore.mesh.pose import PosedSheet
from restore.scan import Floats

SEED = 1
PAPER_DRAG = 0.05  # eq. 4
STABLE_STRAIN = 0.05  # rms of the edges after the last time step: settled runs end below 0.02, diverged ones above 0.1
STEP_GROWTH = 1.15  # from a method's own step up to the first that diverges: above it lie islands of luck
LONGEST_STEP = 10.0  # s: from anywhere on a page a particle is on the table after one such step
STEP_RATIO = 1.01  # the largest stable step is found to this factor

# Page of the paper's Table 2: a sheet of ours for it and its points; the paper's seconds for adding the bending
# resistance, for flattening, for both, and for the mass-spring method.
TABLE_2: dict[str, tuple[Sheet, int, tuple[float, float, float, float]]] = {
    "a curl": (Curl(), 1087, (0.25, 5.37, 5.62, 52.35)),
    "b binding": (Binding(), 1264, (0.27, 9.25, 9.52, 64.36)),
    "c deep gutter": (Spread(slope_deg=66.0), 1287, (0.28, 9.68, 9.96, 66.42)),
    "d wave": (Wave(), 1154, (0.26, 5.56, 5.82, 56.67)),
    "e cone": (Cone(), 1181, (0.26, 7.25, 7.51, 63.78)),
    "f crumpled": (Crumpled(), 4986, (0.34, 10.35, 10.69, 72.43)),
    "g multi-fold": (MultiFold(), 1446, (0.29, 7.87, 8.16, 62.54)),
    "h Miura fold": (Miura(), 4732, (0.33, 10.13, 10.46, 71.07)),
}
FIG_7_POINTS = 999
STEP_WANTED = 10  # times as long a step; the paper's figures are 16 times apart
FIG_3_4: dict[str, tuple[Sheet, int]] = {
    "deep spine, 78°": (Spread(slope_deg=78.0, reach_mm=40.0), 1287),
    "roll of 160°": (Curl(radius_mm=100.0, taper=0.0), 1287),
}

AT_REST: dict[ModuleType, dict[str, float]] = {sticks: {"LANDED": 0.0}}  # the sticks stop before, as soon as they may

Solver = Callable[..., Solution]


@dataclass(frozen=True)
class Outcome:
    """rms strain and flips after the last time step; flips and rms mm off the truth in the end."""

    seconds: float
    steps: int
    strain: float
    flips: int
    end_flips: int
    rms_mm: float


def main() -> None:
    """Print Table 2, Fig. 7 and Figs. 3 and 4."""
    table_2()
    fig_7()
    figs_3_4()


def table_2() -> None:
    """Seconds for the bending set-up, flattening and both together, beside the paper's."""
    print("Table 2: seconds on one core, in brackets the paper's (Pentium III, 996 MHz); medians of", REPEATS)
    row = "{:<14}{:>6} {:>15} {:>15} {:>15} {:>16} {:>11} {:>10} {:>10} {:>20} {:>20}"
    timed = ("bending", "flattening", "total", "springs, total", "ratio")
    print(row.format("sheet", "points", *timed, "mm", "springs mm", "isometric s, mm", "applicable s, mm"))
    for name, (sheet, points, paper) in TABLE_2.items():
        warped = exact_sheet(sheet, points, seed=SEED)
        posed, network = warped.posed(), warped.network()
        solvers = (flatten_sticks, flatten_springs, flatten_isometric, flatten_applicable)
        ours, theirs, *others = (outcome(solver, warped, posed, network) for solver in solvers)
        runs = [partial(solver, posed, network, None) for solver in solvers]
        bending, falling, springing, *taken = in_turns(warped.network, *runs)
        measured = (bending, falling, bending + falling, bending + springing)
        cells = [f"{here:.4f} ({there:.2f})" for here, there in zip(measured, paper, strict=True)]
        ratio = f"{measured[3] / measured[2]:.1f} ({paper[3] / paper[2]:.1f})"
        errors = (f"{ours.rms_mm:.4f}", f"{theirs.rms_mm:.4f}")
        columns = (f"{bending + s:.4f}, {other.rms_mm:.4f}" for s, other in zip(taken, others, strict=True))
        print(row.format(name, points, *cells, ratio, *errors, *columns), flush=True)


def fig_7() -> None:
    """A multi-folded page of 999 points: time, overlaps, largest stable time step."""
    warped = exact_sheet(MultiFold(), FIG_7_POINTS, seed=SEED)
    methods: dict[str, tuple[Solver, ModuleType, dict[str, float], str, str]] = {
        "sticks": (flatten_sticks, sticks, {}, "3.13", "0.32"),
        "sticks, drag 0.05": (flatten_sticks, sticks, {"DRAG": PAPER_DRAG}, "3.13", "0.32"),
        "springs": (flatten_springs, springs, {}, "about 50", "0.02"),
    }
    print(f"\nFig. 7: multi-fold, {FIG_7_POINTS} points; in brackets the paper's figures")
    row = "{:<20} {:>18} {:>6} {:>8} {:>9} {:>22}"
    print(row.format("method", "seconds", "steps", "flipped", "rms mm", "largest stable step s"))
    steps = {}
    for name, (solver, module, constants, paper_seconds, paper_step) in methods.items():
        changed = with_constants(solver, module, **constants)
        found = median_outcome(changed, warped, warped.posed(), warped.network())
        step = steps[name] = largest_stable_step(warped, solver, module, **constants, **AT_REST.get(module, {}))
        cells = (f"{found.seconds:.4f} ({paper_seconds})", found.steps, found.end_flips, f"{found.rms_mm:.4f}")
        print(row.format(name, *cells, f"{step:.3f} ({paper_step})"), flush=True)
    ratio = steps["sticks"] / steps["springs"]
    verdict = "yes" if ratio >= STEP_WANTED else "no"
    print(f"largest stable step, sticks over springs: {ratio:.1f}; at least {STEP_WANTED}: {verdict}")


def figs_3_4() -> None:
    """Flipped faces with and without bending resistance and drag."""
    print("\nFigs. 3 and 4: faces flipped after the last time step → after the relaxation in the plane (rms mm)")
    row = "{:<18} {:<8} {:>22} {:>22} {:>22} {:>22}"
    drags = {f"drag {sticks.DRAG}": sticks.DRAG, f"drag {PAPER_DRAG}": PAPER_DRAG, "no drag": 0.0}
    print(row.format("sheet", "hinges", *(f"sticks, {name}" for name in drags), "springs"))
    for name, (sheet, points) in FIG_3_4.items():
        warped = exact_sheet(sheet, points, seed=SEED)
        posed, network = warped.posed(), warped.network()
        solvers = [with_constants(flatten_sticks, sticks, DRAG=drag) for drag in drags.values()] + [flatten_springs]
        for hinges, bending in (("with", True), ("without", False)):
            found = [outcome(partial(solver, bending=bending), warped, posed, network) for solver in solvers]
            print(row.format(name, hinges, *(f"{f.flips} → {f.end_flips} ({f.rms_mm:.3f})" for f in found)), flush=True)


def with_constants(solver: Solver, module: ModuleType, **constants: float) -> Solver:
    """The solver of a module with other constants than its own: what is studied here and nobody's setting."""
    if not constants:
        return solver

    values: dict[str, Any] = dict(constants)

    def changed(*arguments: Any, **options: Any) -> Solution:
        with mock.patch.multiple(module, **values):
            return solver(*arguments, **options)

    return changed


def largest_stable_step(warped: ExactSheet, solver: Solver, module: ModuleType, **constants: float) -> float:
    """The time step in seconds up to which the sheet comes to rest unstretched: climbing, then bisection."""
    posed, network = warped.posed(), warped.network()

    def stable(step: float) -> bool:
        found = outcome(with_constants(solver, module, TIME_STEP=step, **constants), warped, posed, network)
        return found.steps < module.MAX_STEPS and found.strain < STABLE_STRAIN

    low = high = float(module.TIME_STEP)
    while high < LONGEST_STEP and stable(high):
        low, high = high, high * STEP_GROWTH
    while high / low > STEP_RATIO:
        middle = (low * high) ** 0.5
        low, high = (middle, high) if stable(middle) else (low, middle)
    return low


def median_outcome(solver: Solver, warped: ExactSheet, posed: PosedSheet, network: Network) -> Outcome:
    """How a flattening ends, with the median of its seconds, unobserved."""
    found = outcome(solver, warped, posed, network)
    return replace(found, seconds=median_seconds(partial(solver, posed, network, None)))


def outcome(solver: Solver, warped: ExactSheet, posed: PosedSheet, network: Network) -> Outcome:
    """Flatten and compare; a run that diverges ends with infinite strain."""
    last = posed.positions

    def follow(_: int, positions: Floats) -> None:
        nonlocal last
        last = positions

    start = time.perf_counter()
    try:
        flat, steps, *_ = solver(posed, network, follow)
    except BadInput:
        return Outcome(np.nan, 0, np.inf, len(network.faces), len(network.faces), np.inf)
    seconds = time.perf_counter() - start
    if not np.isfinite(flat).all():
        return Outcome(seconds, steps, np.inf, len(network.faces), len(network.faces), np.inf)
    strain = float(np.sqrt(np.mean(edge_strain(last[:, :2], network.edges, network.lengths) ** 2)))
    flips, end_flips = (flipped_faces(positions, network.faces) for positions in (last[:, :2], flat))
    rms = float(np.sqrt((rigid_residual(flat, warped.flat)[0] ** 2).sum(axis=1).mean()))
    return Outcome(seconds, steps, strain, flips, end_flips, rms)


if __name__ == "__main__":
    main()

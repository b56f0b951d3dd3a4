"""Flattening beside libigl's: LSCM, ARAP (Liu et al. 2008) and SLIM (Rabinovich et al. 2017), on the same meshes."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from bench.exact import ExactSheet, exact_sheet
from bench.markers import rigid_residual
from drivers.simulated.sheets import Curl, MultiFold, Sheet, Spread
from restore.flatten.conformal import far_apart, flatten_conformal
from restore.flatten.network import Network
from restore.flatten.sticks import flatten_sticks
from restore.scan import Floats
from restore.strain import edge_strain, flipped_faces, surface_area

REPEATS = 3
SEED = 1
SHEETS: dict[str, Sheet] = {"curl": Curl(), "multi-fold": MultiFold(), "deep gutter": Spread(slope_deg=66.0)}
POINTS = (1_000, 5_000)
NOISE_MM = (0.0, 0.1)
# ARAP then is 0.04 mm from where it ends on the deep gutter and 0.002 mm elsewhere; SLIM, at 20, as near as ARAP at 20.
ITERATIONS = 50
ROW = "{:<12}{:>7}{:>7} {:<22}{:>9}{:>9}{:>9}{:>9}{:>7}"


def main() -> None:
    """Print seconds, truth, strain and flips of every method on every mesh; one line when libigl is not there."""
    try:
        import igl
    except ImportError:
        print("peers: libigl is not installed (the extra `bench` brings it)")
        return
    print(f"\npeers: medians of {REPEATS} runs; rms mm off the truth after a rigid fit, rms strain of the edges")
    print(ROW.format("sheet", "points", "noise", "method", "seconds", "rms mm", "scale", "strain", "flips"))
    for name, sheet in SHEETS.items():
        for points in POINTS:
            for noise in NOISE_MM:
                warped = exact_sheet(sheet, points, noise_mm=noise, seed=SEED)
                for line in lines(igl, warped):
                    print(ROW.format(name, points, noise, *line), flush=True)


def lines(igl: Any, warped: ExactSheet) -> Iterator[tuple[str, ...]]:
    """Method, seconds, rms mm, best scale, rms strain and flips on one mesh."""
    chords, true = warped.network(chords=True), warped.network()
    methods: dict[str, Callable[[], Floats]] = {
        "sticks": partial(ours, flatten_sticks, warped, chords=True),
        "conformal": partial(ours, flatten_conformal, warped, chords=True),
        "sticks, true lengths": partial(ours, flatten_sticks, warped, chords=False),
        "igl LSCM": partial(lscm, igl, warped),
        "igl LSCM + ARAP": partial(arap, igl, warped),
        "igl LSCM + SLIM": partial(slim, igl, warped),
    }
    for name, flatten in methods.items():
        seconds, flat = timed(flatten)
        yield name, f"{seconds:.4f}", *judged(flat, warped, true if "true" in name else chords)


def ours(solver: Callable[..., tuple[Floats, int]], warped: ExactSheet, *, chords: bool) -> Floats:
    """All that `restore.flatten` does for one piece: network, laying down, flattening."""
    flat: Floats = solver(warped.laid(), warped.network(chords=chords))[0]
    return flat


def lscm(igl: Any, warped: ExactSheet) -> Floats:
    """libigl's conformal map, scaled to the area of the surface, as ours is."""
    mesh, held = warped.mesh, np.array(far_apart(warped.mesh.vertices))
    found, _ = igl.lscm(mesh.vertices, mesh.faces, held, np.array([[0.0, 0.0], [1.0, 0.0]]))
    area = surface_area(np.column_stack([found, np.zeros(len(found))]), mesh.faces)
    return np.asarray(found * np.sqrt(surface_area(mesh.vertices, mesh.faces) / area))


def arap(igl: Any, warped: ExactSheet) -> Floats:
    """As rigid as possible from the conformal map, one vertex held, without which libigl refuses."""
    mesh, start = warped.mesh, lscm(igl, warped)
    data = igl.ARAPData()
    data.max_iter = ITERATIONS
    igl.arap_precomputation(mesh.vertices, mesh.faces, 2, np.array([0], np.int32), data)
    return np.asarray(igl.arap_solve(start[:1], data, start))


def slim(igl: Any, warped: ExactSheet) -> Floats:
    """Scalable locally injective mapping (symmetric Dirichlet) from the conformal map, no vertex held."""
    mesh, start = warped.mesh, lscm(igl, warped)
    data = igl.slim_precompute(
        np.asfortranarray(mesh.vertices),
        np.asfortranarray(mesh.faces, dtype=np.int32),
        np.asfortranarray(start),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.empty(0, np.int32),
        np.asfortranarray(np.empty((0, 2))),
        0.0,
    )
    return np.asarray(igl.slim_solve(data, ITERATIONS))[:, :2]


def timed(flatten: Callable[[], Floats]) -> tuple[float, Floats]:
    """Median seconds of several runs after one to warm up, and the flat positions."""
    flat, taken = flatten(), []
    for _ in range(REPEATS):
        start = time.perf_counter()
        flat = flatten()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken), flat


def judged(flat: Floats, warped: ExactSheet, network: Network) -> tuple[str, str, str, str]:
    """rms mm off the truth after a rigid fit, best scale, rms strain against a network's lengths, flipped faces."""
    rest, scale = rigid_residual(flat, warped.flat)
    strain = edge_strain(flat, network.edges, network.lengths)
    rms = np.sqrt((rest**2).sum(axis=1).mean())
    flips = flipped_faces(flat, network.faces)
    return f"{rms:.4f}", f"{scale:.5f}", f"{np.sqrt((strain**2).mean()):.5f}", str(flips)


if __name__ == "__main__":
    main()

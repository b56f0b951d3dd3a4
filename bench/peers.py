"""`python -m bench.peers [--full]`: restore.flattening beside libigl's LSCM, ARAP and SLIM, on the same meshes."""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from bench.memory import peak_growth_mb
from drivers.scanner import SettingsError
from drivers.simulated import Curl, Spread, shoot
from drivers.simulated.scene.sheets import Sheet
from oracles.exact import add_noise, exact_sheet
from oracles.markers import rigid_residual
from oracles.sheets import CASES
from restore import flatten
from restore.mesh.measures import edge_strain, flipped_faces, straight_lengths
from restore.mesh.network import make_network
from restore.mesh.topology import Topology
from restore.mesh.triangulate import triangulate
from restore.scan import Floats, SurfaceMesh

SEED = 1
NOISE_MM = (0.0, 0.1)
SHEETS: dict[str, Sheet] = {
    **{name: case.sheet for name, case in CASES.items()},
    "deep spine": Spread(slope_deg=78.0, reach_mm=40.0),
    "roll of 230°": Curl(radius_mm=70.0, taper=0.0),
}
ROUNDS = {1_000: 3, 5_000: 2}  # of all methods in turn, so that a busy machine is busy for all; larger meshes run once
LARGE = 50_000
GRID = 300_000  # about: all samples that the scanner gets of a page
SAME_MM = 0.0005  # rms: what tells two results apart; below lie the methods' own limits of convergence
OURS, CHORDS = "restore.flattening", "sticks on chords"
ROW = "{:<13}{:>7}{:>6} {:<18}{:>9}{:>10}{:>10}{:>7}{:>8}"
# Times of a peer over ours that are promised, by points.
PROMISED = {1_000: {"igl SLIM": 5.0, "igl ARAP": 3.0}, 5_000: {"igl SLIM": 5.0}}

Method = Callable[[SurfaceMesh], Floats]


@dataclass(frozen=True)
class Result:
    """A method on a mesh: seconds (least of all rounds), rms mm off the truth after a rigid fit, rms strain of the
    edges against their true lengths, flipped faces, growth of the process in MB (large meshes)."""

    sheet: str
    points: int
    noise_mm: float
    method: str
    seconds: float
    rms_mm: float
    strain: float
    flips: int
    memory_mb: float | None


def main(*, full: bool = False) -> list[Result]:
    """Print a line for every method on every mesh, then what it comes to; a line alone when libigl is not there."""
    try:
        from bench import libigl
    except ImportError:
        print("peers: libigl is not installed (the extra `bench` brings it)")
        return []
    peers: dict[str, Method] = {"igl LSCM": libigl.lscm, "igl ARAP": libigl.arap, "igl SLIM": libigl.slim}
    print("\npeers: least seconds of", ROUNDS, "rounds, above one; rms mm off the truth, moved and turned alone;")
    print("rms strain against the true lengths of the edges; noise mm along the lines of sight")
    print(ROW.format("sheet", "points", "noise", "method", "seconds", "rms mm", "strain", "flips", "MB"))
    results = []
    for name, mesh, truth, noise in meshes():
        for result in compared(name, mesh, truth, noise, methods_for(len(mesh.vertices), peers, full=full)):
            results.append(result)
            print(_line(result), flush=True)
    verdicts(results)
    return results


def meshes() -> Iterator[tuple[str, SurfaceMesh, Floats, float]]:
    """Name, mesh, flat truth (n, 2) mm and noise of every case."""
    for points in (*ROUNDS, LARGE):
        for name, sheet in SHEETS.items():
            for noise in NOISE_MM:
                exact = exact_sheet(sheet, points, noise_mm=noise, seed=SEED)
                yield name, exact.mesh, exact.flat, noise
    for name, sheet in SHEETS.items():
        for noise in NOISE_MM:
            try:
                yield name, *scanned(sheet, noise), noise
            except SettingsError:  # a sheet that folds over itself before the scanner
                continue


def scanned(sheet: Sheet, noise_mm: float) -> tuple[SurfaceMesh, Floats]:
    """All that a scanner without a flaw, or with noise alone, sees of a page, and its flat truth (n, 2) mm."""
    scan, truth = shoot(sheet, noise=False, table="none")
    pixels = np.argwhere(scan.measured & np.isfinite(truth.flat).all(axis=2))
    points = np.full_like(scan.points, np.nan)
    rows, cols = pixels.T
    points[rows, cols] = add_noise(scan.points[rows, cols], np.zeros(3), noise_mm, np.random.default_rng(SEED))
    mesh = triangulate(replace(scan, points=points))
    at = {tuple(xy): k for k, xy in enumerate(scan.texture_xy[rows, cols])}
    index = np.array([at[tuple(xy)] for xy in mesh.texcoords])
    return mesh, truth.flat[rows, cols][index]


def methods_for(points: int, peers: dict[str, Method], *, full: bool) -> dict[str, Method]:
    """Ours as a user calls it and on the peers' lengths, and the peers that end in reasonable time."""
    ours: dict[str, Method] = {OURS: lambda mesh: flatten(mesh).flat}
    if points < LARGE:
        ours[CHORDS] = on_chords
    slow = set() if full or points < LARGE else {"igl SLIM"} if points == LARGE else {"igl SLIM", "igl ARAP"}
    return ours | {name: method for name, method in peers.items() if name not in slow}


def on_chords(mesh: SurfaceMesh) -> Floats:
    """The sticks with no more than the peers are given: straight distances."""
    return flatten(mesh, lengths=make_network(mesh.vertices, Topology(mesh.faces)).lengths).flat


def compared(name: str, mesh: SurfaceMesh, truth: Floats, noise: float, methods: dict[str, Method]) -> Iterator[Result]:
    """What every method makes of a mesh, the methods in turn in every round."""
    points, large = len(mesh.vertices), len(mesh.vertices) >= LARGE
    seconds: dict[str, list[float]] = {method: [] for method in methods}
    found: dict[str, Floats] = {}
    memory: dict[str, float] = {}
    for _ in range(ROUNDS.get(points, 1)):
        for method, run in methods.items():
            with peak_growth_mb() as growth:
                start = time.perf_counter()
                found[method] = run(mesh)
                seconds[method].append(time.perf_counter() - start)
            memory[method] = growth()
    edges = Topology(mesh.faces).edges
    lengths = straight_lengths(truth, edges)
    for method, flat in found.items():
        rest, _ = rigid_residual(flat, truth)
        rms = float(np.sqrt((rest**2).sum(axis=1).mean()))
        strain = float(np.sqrt(np.mean(edge_strain(flat, edges, lengths) ** 2)))
        flips = flipped_faces(flat, mesh.faces)
        used = memory[method] if large else None
        yield Result(name, points, noise, method, min(seconds[method]), rms, strain, flips, used)


def _line(r: Result) -> str:
    memory = "" if r.memory_mb is None else f"{r.memory_mb:.0f}"
    figures = f"{r.seconds:.4f}", f"{r.rms_mm:.4f}", f"{r.strain:.5f}", r.flips, memory
    return ROW.format(r.sheet, r.points, r.noise_mm, r.method, *figures)


def verdicts(results: list[Result]) -> None:
    """Whether we are as near to the truth as the best peer on every mesh, and as much faster as we say."""
    print("\nas near to the truth as the best peer:")
    groups = [list(g) for _, g in groupby(results, key=lambda r: (r.sheet, r.points, r.noise_mm))]
    held = 0
    for group in groups:
        ours = next(r for r in group if r.method == OURS)
        best = min((r for r in group if r.method.startswith("igl")), key=lambda r: r.rms_mm)
        yes = ours.rms_mm <= best.rms_mm + SAME_MM
        held += yes
        if not yes:
            print(
                f"  no: {ours.sheet}, {ours.points} points, noise {ours.noise_mm}: {ours.rms_mm:.4f} mm, "
                f"{best.method} {best.rms_mm:.4f} mm"
            )
    print(f"  yes on {held} of {len(groups)} meshes (within {SAME_MM} mm)")
    print("times of a peer over ours, median (least) of all sheets:")
    for points, wanted in PROMISED.items():
        for peer, factor in wanted.items():
            if not (ratios := _ratios(results, points, peer)):
                continue
            verdict = "yes" if min(ratios) >= factor else "no"
            print(
                f"  {peer}, {points} points: {statistics.median(ratios):.1f} ({min(ratios):.1f}); "
                f"at least {factor:.0f} on every sheet: {verdict}"
            )


def _ratios(results: list[Result], points: int, peer: str) -> list[float]:
    seconds = {(r.sheet, r.noise_mm, r.method): r.seconds for r in results if r.points == points}
    return [seconds[s, n, peer] / t for (s, n, method), t in seconds.items() if method == OURS]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="ARAP and SLIM on the largest meshes too: an hour and more")
    main(full=parser.parse_args().full)

"""`python -m bench.growth [PLOT]`: how time and memory of restore.flattening grow with the points."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from bench.memory import peak_growth_mb
from bench.peers import scanned
from drivers.simulated import Curl
from oracles.exact import exact_sheet
from oracles.markers import rigid_residual
from restore import SurfaceMesh, flatten
from restore.range_image.resample import MIN_VERTICES
from restore.scan import Floats

PLOT = Path(__file__).parent.parent / "docs" / "images" / "growth.png"
POINTS = (1_000, 2_000, 5_000, 10_000, 20_000, 39_000, 50_000, 100_000, 200_000)
NOISE_MM = {"clean": 0.0, "0.1 mm noise": 0.1}
SHEET = Curl()
REPEATS = 2  # the least of them counts
LARGE = 50_000  # vertices: these run once
ROW = "{:>8} {:<14}{:>10}{:>10}{:>10}"

Measured = dict[str, list[tuple[int, float, float]]]  # noise → points, seconds, MB


def main(plot: Path | None = None) -> None:
    """Print seconds, MB and rms mm for every number of points, the whole range grid last, and draw them."""
    print("\ngrowth of restore.flattening with the points, a curl; MB that the process grows by at its peak")
    print(ROW.format("points", "vertices", "seconds", "MB", "rms mm"))
    measured: Measured = {name: [] for name in NOISE_MM}
    for points in (*POINTS, None):
        for name, noise in NOISE_MM.items():
            mesh, truth = _mesh(points, noise)
            seconds, memory, rms = _measured(mesh, truth)
            measured[name].append((len(mesh.vertices), seconds, memory))
            print(ROW.format(len(mesh.vertices), name, f"{seconds:.3f}", f"{memory:.0f}", f"{rms:.4f}"), flush=True)
    if plot:
        draw(measured, plot)


def _mesh(points: int | None, noise: float) -> tuple[SurfaceMesh, Floats]:
    if points is None:
        return scanned(SHEET, noise)
    exact = exact_sheet(SHEET, points, noise_mm=noise)
    return exact.mesh, exact.flat


def _measured(mesh: SurfaceMesh, truth: Floats) -> tuple[float, float, float]:
    seconds, memory, flat = np.inf, 0.0, truth
    for _ in range(REPEATS if len(mesh.vertices) < LARGE else 1):
        with peak_growth_mb() as growth:
            start = time.perf_counter()
            flat = flatten(mesh).flat
            seconds = min(seconds, time.perf_counter() - start)
        memory = max(memory, growth())
    rest, _ = rigid_residual(flat, truth)
    return seconds, memory, float(np.sqrt((rest**2).sum(axis=1).mean()))


def draw(measured: Measured, path: Path) -> None:
    """Two panels: seconds and MB over the points."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9, 3.6), layout="constrained")
    for axes, column, label in zip(figure.subplots(1, 2), (1, 2), ("seconds", "MB at the peak"), strict=True):
        for name, lines in measured.items():
            axes.loglog(
                [line[0] for line in lines], [max(line[column], 1e-3) for line in lines], "o-", ms=4, label=name
            )
        axes.axvline(MIN_VERTICES, color="0.7", lw=1, ls="--")
        axes.text(MIN_VERTICES, axes.get_ylim()[0], " over a range grid", fontsize=7, color="0.4", va="bottom")
        axes.set(xlabel="vertices", ylabel=label)
        axes.grid(True, which="both", color="0.92", lw=0.6)
        axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))

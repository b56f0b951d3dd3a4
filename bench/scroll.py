"""`python -m bench.scroll [--points 2000000] [--seed S] [--slim SECONDS]`: a segment of a scroll, laid flat.

A synthetic segment of three windings, in voxels, as a grid with noise, in which some patches lie on the next winding,
as where a tracer jumped. The grid's own place on the sheet is the truth. libigl's SLIM gets the same segment with fewer
points, twice as many every time, until it does not end in the time that it has. It starts from the grid itself, which
inverts no face: noise and jumps leave the conformal map full of inverted ones, and SLIM diverges from there.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass

import numpy as np

from bench.memory import peak_growth_mb
from oracles.markers import rigid_residual
from restore import flatten
from restore.flattening.isometric import least_distortion
from restore.mesh.ordered_grid import GridMesh, grid_faces
from restore.scan import Floats, Mask, SurfaceMesh

POINTS = 2_000_000
WINDINGS = 3.0
INNER, PITCH = 200.0, 25.0  # voxels: the innermost radius, and from one winding to the next
HEIGHT = 500.0
NOISE = 0.3
JUMPS = 4
JUMP_FRACTION = (0.05, 0.15)  # of either side of the segment
FIRST_SLIM = 5_000
SLIM_SECONDS = 600.0
SLIM_STEP, SLIM_STILL, SLIM_ITERATIONS = 5, 1e-3, 100  # iterations between looks, voxels rms, iterations at most
ASKED_SECONDS, ASKED_MB = 60.0, 3000.0


@dataclass(frozen=True, eq=False)
class Scroll:
    """A segment, in voxels: its mesh, where its points belong (n, 2) on the sheet, and which of them jumped (n,)."""

    mesh: GridMesh
    flat: Floats
    jumped: Mask


def scroll(points: int, seed: int) -> Scroll:
    """A segment of about so many points of a sheet that is rolled up to an Archimedean spiral."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2.0 * np.pi * WINDINGS, 20_000)
    radii = INNER + PITCH * angles / (2.0 * np.pi)
    arcs = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radii), np.diff(angles) * (radii[1:] + radii[:-1]) / 2))])
    step = float(np.sqrt(arcs[-1] * HEIGHT / points))
    x, y = np.arange(0.0, arcs[-1], step), np.arange(0.0, HEIGHT, step)
    jumped = np.zeros((len(y), len(x)), bool)
    for _ in range(JUMPS):
        size = (rng.uniform(*JUMP_FRACTION, 2) * jumped.shape).astype(int)
        row, col = (int(rng.integers(0, whole - part)) for whole, part in zip(jumped.shape, size, strict=True))
        jumped[row : row + size[0], col : col + size[1]] = True
    angle = np.interp(x, arcs, angles)
    radius = INNER + PITCH * (angle / (2.0 * np.pi) + jumped)
    surface = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.broadcast_to(y[:, None], radius.shape)], -1)
    surface += rng.normal(scale=NOISE, size=surface.shape)
    whole = np.ones(jumped.shape, bool)
    mesh = GridMesh(surface.reshape(-1, 3), grid_faces(whole), shape=jumped.shape, places=np.arange(jumped.size))
    return Scroll(mesh, np.stack(np.meshgrid(x, -y), axis=-1).reshape(-1, 2), jumped.ravel())


def error(flat: Floats, truth: Scroll) -> float:
    """rms voxels off the truth, by the best motion, of flat (n, 2) where the segment did not jump."""
    rest, _ = rigid_residual(flat[~truth.jumped], truth.flat[~truth.jumped])
    return float(np.sqrt((rest**2).sum(axis=1).mean()))


def slim(mesh: SurfaceMesh, start: Floats, seconds: float) -> Floats | None:
    """The page (n, 2) by SLIM from a start (n, 2), or None where that has not converged in so many seconds."""
    began, flat = time.perf_counter(), start
    steps = least_distortion.slim(mesh.vertices, mesh.faces, start, SLIM_STEP)
    for _ in range(SLIM_ITERATIONS // SLIM_STEP):
        before, flat = flat, next(steps)
        if time.perf_counter() - began > seconds:
            return None
        if np.sqrt(((flat - before) ** 2).sum(axis=1).mean()) < SLIM_STILL:
            break
    return flat


def main(points: int, seed: int, slim_seconds: float) -> None:
    """Print a line for the segment, one for each size that SLIM can do, and whether what is asked is reached."""
    print(f"a scroll of {WINDINGS:g} windings, {NOISE} voxels of noise, {JUMPS} jumps, seed {seed}")
    print("points    method       seconds       MB   rms voxels")
    whole = scroll(points, seed)
    with peak_growth_mb() as growth:
        start = time.perf_counter()
        page = flatten(whole.mesh)
        seconds = time.perf_counter() - start
    off = _line(page.flat, whole, "isometric", seconds, growth())
    over = whole.jumped[page.edges[:, 0]] != whole.jumped[page.edges[:, 1]]
    strain = np.abs(page.strain)
    print(f"strain over jumps: median {np.median(strain[over]):.2f}, elsewhere {np.median(strain[~over]):.5f}")
    size = FIRST_SLIM
    while slim_seconds > 0 and size <= points:
        part = scroll(size, seed)
        start = time.perf_counter()
        flat = slim(part.mesh, part.flat, slim_seconds)
        seconds = time.perf_counter() - start
        if flat is None:
            print(f"{size:8d}  SLIM does not end in {slim_seconds:.0f} s")
            break
        theirs = _line(flat, part, "SLIM", seconds, None)
        start = time.perf_counter()
        ours = _line(flatten(part.mesh).flat, part, "isometric", time.perf_counter() - start, None)
        print(f"{'':10}less than SLIM's: {'yes' if max(ours, off) < theirs else 'no'}")
        size *= 2
    print(f"asked: {ASKED_SECONDS:.0f} s and {ASKED_MB:.0f} MB for {POINTS} points")


def _line(flat: Floats, truth: Scroll, method: str, seconds: float, megabytes: float | None) -> float:
    off, memory = error(flat, truth), "" if megabytes is None else f"{megabytes:.0f}"
    print(f"{len(flat):8d}  {method:<12}{seconds:8.1f} {memory:>8} {off:12.4f}", flush=True)
    return off


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--seed", type=int, default=int(time.strftime("%Y%m%d")))
    parser.add_argument("--slim", type=float, default=SLIM_SECONDS, help="seconds that SLIM has for a size, 0 for none")
    options = parser.parse_args()
    main(options.points, options.seed, options.slim)

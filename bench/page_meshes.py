"""`python -m bench.page_meshes [--count 3] [--seed S]`: size of pages that come as irregular meshes.

Each is a triangulation of samples of a shot, one at random in every two by two, turned anywhere: of the page alone, as
one cuts it out by hand, and with the table that it lies on. Sheets and noise are drawn from the seed, by default of
today. The mesh ends up to a sample inside the page; what is printed is how far its sides are off in the end.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from bench.draws import run, seed_of_today
from bench.layout import SHEETS, TILT_DEG
from drivers.simulated import Pose, Truth, shoot
from restore import RangeScan, RestoreError, Settings, SurfaceMesh, restore
from restore.scan import Mask

COUNT = 3
STEP = 2  # samples
LONGEST = 4.0 * STEP  # samples of an edge: wider gaps stay open
DPI = 60  # the size of a page does not depend on it
ROW = "{:<12} {:>12} {:>16} {:>12} {:>16} {:>8} {:>8}"
HEADINGS = ("sheet", "alone mm", "alone worst mm", "on table mm", "on table worst mm", "failed", "warned")


def main(count: int = COUNT, seed: int | None = None) -> None:
    """Print a line for each kind of sheet: median and worst error of the page's sides, alone and on a table."""
    seed = seed or seed_of_today()
    print(f"\nsides of pages from irregular meshes, {count} sheets of each kind, seed {seed}")
    print(ROW.format(*HEADINGS))
    for number, (kind, (_, draw)) in enumerate(SHEETS.items()):
        errors, failed, warned = {True: list[float](), False: list[float]()}, 0, 0
        for k in range(count):
            rng = np.random.default_rng([seed, number, k])
            pose = Pose(tilt_deg=rng.uniform(-TILT_DEG, TILT_DEG), turn_deg=rng.uniform(-TILT_DEG, TILT_DEG))
            scan, truth = shoot(draw(rng), seed=int(rng.integers(2**31)), pose=pose)
            for alone in errors:
                try:
                    page = restore(irregular(scan, truth, rng, alone=alone), Settings(dpi=DPI))
                except RestoreError:
                    failed += 1
                    continue
                errors[alone].append(side_error(page.report["page_mm"], truth.page_mm))
                warned += bool(page.findings)
        figures = [f"{figure(np.array(found)):.3f}" for found in errors.values() for figure in (np.median, np.max)]
        print(ROW.format(kind, *figures, failed, warned), flush=True)


def irregular(scan: RangeScan, truth: Truth, rng: np.random.Generator, *, alone: bool) -> SurfaceMesh:
    """A mesh of a share of a shot's samples, turned anywhere; alone: of those on the page."""
    chosen = scan.measured & _one_of_each_block(scan.measured.shape, rng)
    if alone:
        chosen &= np.isfinite(truth.flat[..., 0])
    rows, cols = np.nonzero(chosen)
    places = np.stack([cols, -rows], axis=1) + rng.normal(0.0, 0.01, (len(rows), 2))  # no four are on a circle
    faces = Delaunay(places).simplices.astype(np.int64)
    longest = np.linalg.norm(places[faces] - places[np.roll(faces, 1, axis=1)], axis=2).max(axis=1)
    vertices = scan.points[rows, cols] @ Rotation.random(random_state=rng).as_matrix()
    texcoords = scan.texture_xy[rows, cols]
    return SurfaceMesh(vertices, faces[longest < LONGEST], texcoords, scan.texture, {"unit": "mm"})


def _one_of_each_block(shape: tuple[int, ...], rng: np.random.Generator) -> Mask:
    chosen = np.zeros(shape, bool)
    rows, cols = np.mgrid[: shape[0] - STEP : STEP, : shape[1] - STEP : STEP]
    chosen[rows + rng.integers(0, STEP, rows.shape), cols + rng.integers(0, STEP, cols.shape)] = True
    return chosen


def side_error(found: tuple[float, float], true: tuple[float, float]) -> float:
    """Error in mm of the side that is farther off; the page may have come out lying or standing."""
    return float(min(np.abs(np.subtract(found, one)).max() for one in (true, true[::-1])))


if __name__ == "__main__":
    run(main, __doc__, COUNT)

"""From 307,200 samples to the page: how true, how fast, how much memory.

The last column is how many times the page MeshLab takes to decimate the same samples, triangulated, to as many points:
one of the five steps of its user.
"""

from __future__ import annotations

import resource
import statistics
import time
from collections.abc import Mapping
from typing import Any

from drivers.simulated import Pose, shoot
from oracles.markers import marker_error
from oracles.sheets import CASES, Case
from restore import Settings, restore
from restore.mesh.triangulate import triangulate
from restore.pipeline import STAGES
from restore.scan import RangeScan

REPEATS = 3
SEED = 5
TILT_DEG = 3.0  # no page lies quite square to the scanner


HEADINGS = ("rms mm", "limit", "found", "width", "height", "flips", "points", "s", "MeshLab")
ROW = "{:<12} {:>7} {:>6} {:>8} {:>8} {:>8} {:>6} {:>7} {:>6} {:>8}"


def main() -> None:
    """Print a line for every sheet, then the stages of the median run, then the memory."""
    print("scan to page, 1,000 points, 150 dpi, simulated noise, shadow and drop-outs, dark table")
    print(ROW.format("sheet", *HEADINGS))
    reports, ratios = zip(*(_case(name, case) for name, case in CASES.items()), strict=True)
    print(f"MeshLab's decimation alone takes {statistics.median(ratios):.1f} times the page, in the median")
    print("\nstage, median seconds")
    for stage in STAGES:
        print(f"{stage:<10} {statistics.median(report['seconds'][stage] for report in reports):6.3f}")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of this process {peak:.0f} MB, simulation included")


def _case(name: str, case: Case) -> tuple[Mapping[str, Any], float]:
    scan, truth = shoot(case.sheet, seed=SEED, pose=Pose(tilt_deg=TILT_DEG))
    pages = [restore(scan, Settings()) for _ in range(REPEATS + 1)][1:]  # the first run warms up
    page = sorted(pages, key=lambda page: sum(page.report["seconds"].values()))[REPEATS // 2]
    error, report = marker_error(page.image, page.dpi, truth.markers), page.report
    width, height = (measured / true - 1 for measured, true in zip(report["page_mm"], truth.page_mm, strict=True))
    figures = (
        f"{error.rms_mm:.3f}",
        f"{case.limit_mm:.2f}",
        f"{error.found}/{error.of}",
        f"{width:+.2%}",
        f"{height:+.2%}",
    )
    seconds = sum(report["seconds"].values())
    ratio = decimation_seconds(scan, report["points"]) / seconds
    counts = report["flipped_faces"], report["points"]
    print(ROW.format(name, *figures, *counts, f"{seconds:.2f}", f"{ratio:.1f}"), flush=True)
    return report, ratio


def decimation_seconds(scan: RangeScan, points: int) -> float:
    """Return how long MeshLab takes to decimate the samples of a scan, with its own settings."""
    import pymeshlab

    mesh = triangulate(scan)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.faces))
    start = time.perf_counter()
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=2 * points)
    return time.perf_counter() - start


if __name__ == "__main__":
    main()

"""From 307,200 samples to the page: how true, how fast, how much memory."""

from __future__ import annotations

import resource
import statistics
from collections.abc import Mapping
from typing import Any

from drivers.simulated import Pose, shoot
from oracles.markers import marker_error
from oracles.sheets import CASES, Case
from restore import Settings, restore
from restore.pipeline import STAGES

REPEATS = 3
SEED = 5
TILT_DEG = 3.0  # no page lies quite square to the scanner


HEADINGS = ("rms mm", "limit", "found", "width", "height", "flips", "points", "s")
ROW = "{:<12} {:>7} {:>6} {:>8} {:>8} {:>8} {:>6} {:>7} {:>6}"


def main() -> None:
    """Print a line for every sheet, then the stages of the median run, then the memory."""
    print("scan to page, 1,000 points, 150 dpi, simulated noise, shadow and drop-outs, dark table")
    print(ROW.format("sheet", *HEADINGS))
    reports = [_case(name, case) for name, case in CASES.items()]
    print("\nstage, median seconds")
    for stage in STAGES:
        print(f"{stage:<10} {statistics.median(report['seconds'][stage] for report in reports):6.3f}")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory of this process {peak:.0f} MB, simulation included")


def _case(name: str, case: Case) -> Mapping[str, Any]:
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
    seconds = f"{sum(report['seconds'].values()):.2f}"
    print(ROW.format(name, *figures, report["flipped_faces"], report["points"], seconds), flush=True)
    return report


if __name__ == "__main__":
    main()

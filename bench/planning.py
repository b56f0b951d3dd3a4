"""`python -m bench.planning [--scans 100000]`: a folder of scans planned cold and unchanged.

Each scan has a material file and a picture of its own. First nothing is restored; then each has a result, whose report
is looked at once; then nothing has changed since. What must hold: all are planned the first time and none the second;
cold at most 60 s and unchanged at most 5 s of processor time for 100,000.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from pathlib import Path

from bench.scratch import scratch_folder
from station.batch.plan import Plan, plan_folder
from station.run.options import RunOptions

SCANS = 100_000
IN_A_FOLDER = 1_000
COLD_S, UNCHANGED_S = 60.0, 5.0  # of processor time for SCANS
ROW = "{:<34}{:>10}{:>12}{:>10}"


def main(scans: int = SCANS) -> int:
    """Print a line for each start. Returns 1 when one took too long or planned wrongly."""
    with scratch_folder() as scratch:
        folder, out = scratch / "in", scratch / "out"
        make_scans(folder, scans)
        print(ROW.format("start", "to do", "processor s", "wall s"))
        first = _start("cold", lambda: plan_folder(folder, out, RunOptions()))
        make_results(first[0], out)
        second = _start("each with a result", lambda: plan_folder(folder, out, RunOptions()))
        last = _start("nothing changed", lambda: plan_folder(folder, out, RunOptions()))
    wrong = len(first[0].tasks) != scans or bool(second[0].tasks or last[0].tasks)
    late = first[1] > COLD_S * scans / SCANS or last[1] > UNCHANGED_S * scans / SCANS
    return int(wrong or late)


def make_scans(folder: Path, count: int) -> None:
    """Scans in sub-folders of IN_A_FOLDER each, with what belongs to them."""
    for number in range(count):
        place = folder / f"{number // IN_A_FOLDER:03d}"
        if number % IN_A_FOLDER == 0:
            place.mkdir(parents=True)
        stem = f"page-{number:06d}"
        (place / f"{stem}.obj").write_text(f"mtllib {stem}.mtl\nusemtl page\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        (place / f"{stem}.mtl").write_text(f"newmtl page\nmap_Kd {stem}.png\n")
        (place / f"{stem}.png").write_bytes(b"\x89PNG\r\n\x1a\n")


def make_results(plan: Plan, out: Path) -> None:
    """The report of a result for each scan of a plan, and nothing else of it."""
    for scan in plan.scans:
        place = out / scan.source.parent / scan.stem
        place.mkdir(parents=True)
        (place / f"{scan.stem}.json").write_text(json.dumps({"arrival": scan.as_data("")}))


def _start(name: str, plan: Callable[[], Plan]) -> tuple[Plan, float]:
    """What a start planned, and the processor time that it took."""
    before, wall = time.process_time(), time.perf_counter()
    made = plan()
    took = time.process_time() - before
    print(ROW.format(name, len(made.tasks), f"{took:.1f}", f"{time.perf_counter() - wall:.1f}"), flush=True)
    return made, took


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, default=SCANS)
    sys.exit(main(parser.parse_args().scans))

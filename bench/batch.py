"""`python -m bench.batch`: pages on one worker and on two, and what a million pages on a hundred machines would take.

Pages are simulated scans in FAST mode, some sheets again and again. Measured are wall and processor time, memory of
the workers as it grows, bytes read and written, the size of what a scheduler would pass on, and the time of planning.
"""

from __future__ import annotations

import argparse
import pickle
import resource
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from bench.memory import status_mb
from drivers.simulated import Binding, Curl, MultiFold, shoot
from restore import save_scan
from station.batch.page import TaskDone, restore_task
from station.batch.plan import plan_folder
from station.batch.run_tasks import run
from station.run.options import RunOptions
from station.workers.executors import local_workers
from station.workers.process import Limits

PAGES, SHEETS = 60, (Curl(), Binding(), MultiFold())
ROW = "{:>8}{:>10}{:>12}{:>12}{:>14}{:>22}{:>12}"
MILLION, MACHINES, CORES = 1_000_000, 100, 16
HOUR_S, GB = 3600.0, 1e9


@dataclass(frozen=True)
class Measured:
    """One run: wall and processor seconds, memory of the workers after each page and of the parent, MiB; bytes."""

    wall_s: float
    processor_s: float
    workers_mib: tuple[float, ...]
    parent_mib: float
    read: int
    written: int
    passed: int
    planned_s: float
    again_s: float


def main() -> None:
    """Print a line for every number of workers, then the sum for a million pages."""
    parser = argparse.ArgumentParser(prog="python -m bench.batch", description=__doc__)
    parser.add_argument("--pages", type=int, default=PAGES)
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    chosen = parser.parse_args()
    print(ROW.format("workers", "seconds", "pages/h", "cpu s/page", "speed-up", "worker MiB 10th–last", "parent MiB"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "scans"
        maker = get_context("spawn").Process(target=make_scans, args=(folder, chosen.pages))
        maker.start()  # elsewhere: the memory of the simulated scanner is none of the batch's
        maker.join()
        measured = [measure(folder, Path(name) / f"out{count}", count) for count in chosen.workers]
    for count, one in zip(chosen.workers, measured, strict=True):
        print(_row(count, chosen.pages, one, measured[0]))
    print_million(measured[0], chosen.pages)


def make_scans(folder: Path, count: int) -> None:
    """Fill a folder with so many scan folders."""
    for number, sheet in enumerate(SHEETS):
        save_scan(shoot(sheet, seed=number, mode="fast")[0], folder / f"page0000{number}.scan")
    for number in range(len(SHEETS), count):
        original = folder / f"page0000{number % len(SHEETS)}.scan"
        shutil.copytree(original, folder / f"page{number:05}.scan")
    for path in sorted(folder.iterdir())[count:]:
        shutil.rmtree(path)


def measure(folder: Path, out: Path, workers: int) -> Measured:
    """Restore all scans of a folder on so many workers."""
    start, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    plan = plan_folder(folder, out, RunOptions())
    planned = time.perf_counter() - start
    results: list[TaskDone] = []
    with local_workers(workers, Limits()) as places:
        for task, done in run(plan.tasks, places, restore_task):
            assert [one.state for one in done.settled] == ["restored"], (task.name, done)
            results.append(done)
        wall = time.perf_counter() - start
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    start = time.perf_counter()
    assert not plan_folder(folder, out, RunOptions()).tasks
    return Measured(
        wall,
        after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        tuple(done.memory_mib for done in results),
        status_mb("VmHWM"),
        sum(arrival.size for arrival in plan.scans),
        sum(path.stat().st_size for path in out.rglob("*") if path.is_file()),
        len(pickle.dumps((restore_task, plan.tasks[0]))) + len(pickle.dumps(results[0])),
        planned,
        time.perf_counter() - start,
    )


def _row(workers: int, pages: int, one: Measured, first: Measured) -> str:
    growth = f"{one.workers_mib[min(9, pages - 1)]:.0f} – {one.workers_mib[-1]:.0f}"
    speed = f"{first.wall_s / one.wall_s:.2f}"
    rate = f"{3600 * pages / one.wall_s:.0f}"
    return ROW.format(
        workers, f"{one.wall_s:.0f}", rate, f"{one.processor_s / pages:.1f}", speed, growth, f"{one.parent_mib:.0f}"
    )


def print_million(one: Measured, pages: int) -> None:
    """What a million such pages take on MACHINES machines of CORES cores: the figures of one page, multiplied."""
    hours = one.processor_s / pages * MILLION / (MACHINES * CORES) / HOUR_S
    lines: Sequence[tuple[str, str]] = (
        ("processor time", f"{one.processor_s / pages * MILLION / 3600:.0f} core hours"),
        (f"on {MACHINES} machines of {CORES} cores", f"{hours:.1f} hours if nothing else limits"),
        ("memory of a machine", f"{max(one.workers_mib) * CORES / 1024:.0f} GiB at the peak of every worker"),
        ("read from the shared disk", f"{one.read / pages * MILLION / GB:.0f} GB, {_rate(one.read, pages, hours)}"),
        ("written to it", f"{one.written / pages * MILLION / GB:.0f} GB, {_rate(one.written, pages, hours)}"),
        ("through the scheduler", f"{one.passed} bytes a page, {one.passed * MILLION / GB:.1f} GB"),
        ("tasks", f"{MILLION / (hours * HOUR_S):.0f} a second"),
        ("planning", f"{one.planned_s / pages * MILLION / 60:.0f} min anew, {_again(one, pages)} when all is done"),
    )
    print(f"\n{MILLION:,} such pages")
    for name, text in lines:
        print(f"  {name:<32}{text}")


def _rate(count: int, pages: int, hours: float) -> str:
    return f"{count / pages * MILLION / (hours * HOUR_S) / 1e6:.0f} MB/s"


def _again(one: Measured, pages: int) -> str:
    return f"{one.again_s / pages * MILLION / 60:.0f} min"


if __name__ == "__main__":
    main()

"""`python -m bench.kill`: every file event of restorations and scans × six faults.

What must hold after each: the results are those of the earlier run or of this one, every file whole, once the next
command has started; that command ends as ever; nothing else is left in the folder; no exit code 1 and no exception. A
captured scan may stand beside earlier results: it is stored before the page is restored, and is whole or absent.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from bench.kill.events import FAULTS, Fault, count_events, in_child, start_with_library, with_fault
from bench.kill.runs import OUT, Material, Run, Tree, command, computed, place, prepare, runs, tree
from bench.scratch import scratch_folder
from station.errors import StationError
from station.storage.folder_lock import recover

ROW = "{:<32}{:<18}{:>7}{:>7}{:>7}{:>7}  {}"
PROGRESS = 250


@dataclass(frozen=True)
class Point:
    """A fault at one event of a run, which would leave the files `after`."""

    run: Run
    after: Tree
    at: int
    fault: Fault


@dataclass(frozen=True)
class Verdict:
    """What came of a point: the exit code, whether the results are the new ones, what is wrong."""

    run: str
    fault: str
    at: int
    code: int
    new: bool
    wrong: str


def main(workers: int | None = None, only: str = "") -> int:
    """Print a line for each run and fault. Returns 1 when anything is wrong."""
    start = time.perf_counter()
    with scratch_folder() as scratch:
        material = prepare(scratch)
        with computed(material):
            points = [point for run in runs(material) if only in run.name for point in _points(run, material, scratch)]
            with get_context("fork").Pool(workers or len(os.sched_getaffinity(0))) as pool:
                tasks = ((point, material, scratch) for point in points)
                verdicts = list(_reported(pool.imap_unordered(_check, tasks, chunksize=20), len(points)))
    _print_table(verdicts)
    failures = [verdict for verdict in verdicts if verdict.wrong]
    print(f"{len(verdicts)} points, {len(failures)} failures; {time.perf_counter() - start:.0f} s")
    return 1 if failures else 0


def _reported(verdicts: Iterable[Verdict], count: int) -> Iterator[Verdict]:
    """The verdicts, with a line for every PROGRESS of them and for each that is wrong."""
    for number, verdict in enumerate(verdicts, 1):
        if verdict.wrong:
            print(f"  {verdict.run}, {verdict.fault} at event {verdict.at}: {verdict.wrong}", flush=True)
        if number % PROGRESS == 0:
            print(f"  {number} of {count} points", flush=True)
        yield verdict


def _points(run: Run, material: Material, scratch: Path) -> list[Point]:
    """Every fault at every event of a run."""
    folder = scratch / "whole"
    place(run, material, folder)
    code, count = count_events(lambda: command(run.words, folder), folder)
    if code:
        sys.exit(f"planish {' '.join(run.words)} ended with {code}")
    print(f"{run.name}: {count} file events × {len(FAULTS)} faults", flush=True)
    after = tree(folder / OUT)
    return [Point(run, after, at, fault) for fault in FAULTS for at in range(1, count + 1)]


def _check(task: tuple[Point, Material, Path]) -> Verdict:
    point, material, scratch = task
    folder = scratch / f"work-{os.getpid()}"
    place(point.run, material, folder)
    code = with_fault(lambda: command(point.run.words, folder), folder, point.at, point.fault)
    wrong = "" if code in _expected(point.fault) else f"exit code {code}"
    if (folder / OUT).is_dir():
        try:
            recover(folder / OUT)  # with which the next start begins
        except (OSError, StationError) as error:
            wrong = wrong or f"no roll back: {error}"
        wrong = wrong or _mixed(point, tree(folder / OUT))
    new = _results(tree(folder / OUT)) == _results(point.after)
    again = in_child(lambda: command(point.run.again, folder))
    allowed = (2,) if new or _results(point.run.before) else (0, 2)
    wrong = wrong or ("" if again in allowed else f"the next start ends with {again}")
    wrong = wrong or _mixed(point, tree(folder / OUT))
    return Verdict(point.run.name, point.fault.name, point.at, code, new, wrong)


def _expected(fault: Fault) -> tuple[int, ...]:
    """Exit codes that a run with a fault may end with; it may also be done, or not have needed what failed."""
    if fault.name == "SIGKILL":
        return (-fault.number,)
    return (0, 128 + fault.number) if fault.number > 0 else (0, 2, 3, 6)


def _mixed(point: Point, found: Tree) -> str:
    """What is wrong with the files of a folder; empty when they are all old or all new."""
    states = (point.run.before, point.after)
    if not any(_results(found) == _results(state) for state in states):
        return f"neither old nor new: {_differences(found, point)}"
    for capture, files in _captures(found).items():
        if not any(_captures(state).get(capture) == files for state in states):
            return f"the capture {capture} is not whole"
    lost = _captures(point.run.before).keys() - _captures(found).keys()
    return f"captures are lost: {sorted(lost)}" if lost else ""


def _results(files: Tree) -> Tree:
    return {name: data for name, data in files.items() if "/" not in name or not name.split("/")[0].endswith(".scan")}


def _captures(files: Tree) -> dict[str, Tree]:
    captures = dict[str, Tree]()
    for name, data in files.items():
        if name not in _results(files):
            captures.setdefault(name.split("/")[0], {})[name] = data
    return captures


def _differences(found: Tree, point: Point) -> str:
    old, new = _results(point.run.before), _results(point.after)
    kinds = {
        "old": [n for n in found if found[n] == old.get(n)],
        "new": [n for n in found if found[n] == new.get(n) != old.get(n)],
        "other": [n for n in _results(found) if found[n] not in (old.get(n), new.get(n))],
    }
    return ", ".join(f"{len(names)} {kind} ({' '.join(names[:3])})" for kind, names in kinds.items() if names)


def _print_table(verdicts: Sequence[Verdict]) -> None:
    print(ROW.format("run", "fault", "events", "old", "new", "wrong", "exit codes"))
    groups = dict[tuple[str, str], list[Verdict]]()
    for verdict in sorted(verdicts, key=lambda v: (v.run, v.fault)):
        groups.setdefault((verdict.run, verdict.fault), []).append(verdict)
    for (run, fault), group in groups.items():
        new, wrong = sum(verdict.new for verdict in group), sum(bool(verdict.wrong) for verdict in group)
        codes = Counter(verdict.code for verdict in group)
        printed = ", ".join(f"{code}: {count}" for code, count in sorted(codes.items()))
        print(ROW.format(run, fault, len(group), len(group) - new, new, wrong, printed))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, help="processes; one for each processor by default")
    parser.add_argument("--only", default="", help="part of the name of a run")
    options = parser.parse_args()
    start_with_library()
    sys.exit(main(options.workers, options.only))

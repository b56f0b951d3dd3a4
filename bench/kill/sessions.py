"""`python -m bench.kill.sessions`: every file event of a session's steps × six faults.

What must hold after each, once the session is opened again: every step that was acknowledged is there, and at most one
more; everything from before is as it was, `verify` finds nothing, no other file is left, and the next step can be done.
An error of the disk ends with exit code 6.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import typer

from bench.kill.events import FAULTS, Fault, count_events, start_with_library, with_fault
from restore import RangeScan, save_scan
from station.errors import StationError
from station.export.claim import WORK
from station.session import (
    Volume,
    Writer,
    add_scan,
    create_session,
    decide,
    open_session,
    read_session,
    record_run,
    redo,
    undo,
)
from station.session.adding import add_original
from station.session.index import IndexUnusable, entries_of, reindex, sessions, update
from station.session.verify import verify
from station.terminal import report_faults

ROW = "{:<10}{:<18}{:>7}{:>7}{:>7}{:>7}  {}"
MEMORY = Path("/dev/shm")
VOLUME, INDEX, SCAN = "volume", "index", "other.scan"

Acknowledge = Callable[[], None]


@dataclass(frozen=True)
class Run:
    """Steps that are interrupted. work: does them in a folder, and acknowledges each when it has returned."""

    name: str
    work: Callable[[Path, Acknowledge], None]


@dataclass(frozen=True)
class Verdict:
    """What came of a fault: the exit code, the steps acknowledged and found, what is wrong."""

    run: str
    fault: str
    at: int
    code: int
    acknowledged: int
    found: int
    wrong: str


def tiny_scan(seed: int) -> RangeScan:
    """A scan of four by five points, to be stored."""
    random = np.random.default_rng(seed)
    texture = random.integers(0, 256, (8, 8, 3), np.uint8)
    return RangeScan(random.normal(size=(4, 5, 3)), texture, random.uniform(0, 7, (4, 5, 2)), {"seed": seed})


def _in_session(steps: Callable[[Writer, Acknowledge], None]) -> Callable[[Path, Acknowledge], None]:
    def work(folder: Path, acknowledge: Acknowledge) -> None:
        with open_session(folder / VOLUME) as writer:
            steps(writer, acknowledge)

    return work


def _new(folder: Path, acknowledge: Acknowledge) -> None:
    create_session(folder / "another", Volume(title="Another"))
    acknowledge()


def _capture(writer: Writer, acknowledge: Acknowledge) -> None:
    add_scan(writer, tiny_scan(2), facts={})
    acknowledge()


def _again(writer: Writer, acknowledge: Acknowledge) -> None:
    add_scan(writer, tiny_scan(3), page=1, facts={})
    acknowledge()


def _stage(writer: Writer, acknowledge: Acknowledge) -> None:
    folder = writer.staging("run")
    folder.mkdir()
    (folder / "page.png").write_bytes(b"a page" * 1000)
    record_run(writer, "restore", writer.history.event(2), parameters={}, result={}, files=folder)
    acknowledge()


def _decide(writer: Writer, acknowledge: Acknowledge) -> None:
    decide(writer, "accept", True, page=1, on=writer.history.event(2))
    acknowledge()


def _undo(writer: Writer, acknowledge: Acknowledge) -> None:
    undo(writer)
    acknowledge()
    redo(writer)
    acknowledge()


def _shift(writer: Writer, acknowledge: Acknowledge) -> None:
    for step in (_capture, _stage, _decide, _undo):
        step(writer, acknowledge)


def _add(folder: Path, acknowledge: Acknowledge) -> None:
    with open_session(folder / VOLUME) as writer:
        add_original(writer, folder / SCAN)
        acknowledge()


def _index(folder: Path, acknowledge: Acknowledge) -> None:
    update(folder / INDEX, read_session(folder / VOLUME))
    acknowledge()


RUNS = (
    Run("new", _new),
    Run("capture", _in_session(_capture)),
    Run("again", _in_session(_again)),
    Run("stage", _in_session(_stage)),
    Run("decide", _in_session(_decide)),
    Run("undo", _in_session(_undo)),
    Run("shift", _in_session(_shift)),
    Run("add", _add),
    Run("index", _index),
)


def main(workers: int | None = None, only: str = "", share: int = 1) -> int:
    """Print a line for each run and fault. share: one point of so many is tried. Returns 1 when anything is wrong."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(dir=MEMORY if MEMORY.is_dir() else None) as name:
        scratch = Path(name).resolve()
        prepare(scratch / "before")
        tasks = [task for run in RUNS if only in run.name for task in _tasks(run, scratch)][::share]
        with get_context("fork").Pool(workers or len(os.sched_getaffinity(0))) as pool:
            verdicts = pool.map(_judge, tasks, chunksize=20)
    _print_table(verdicts)
    failures = [verdict for verdict in verdicts if verdict.wrong]
    for one in failures:
        print(f"  {one.run}, {one.fault} at event {one.at}: {one.wrong}")
    print(f"{len(verdicts)} points, {len(failures)} failures; {time.perf_counter() - start:.0f} s")
    return 1 if failures else 0


def prepare(folder: Path) -> None:
    """A session with a scan, its restoration and a label; an index that knows it; a scan folder of others."""
    folder.mkdir()
    create_session(folder / VOLUME, Volume(title="A volume"))
    with open_session(folder / VOLUME) as writer:
        add_scan(writer, tiny_scan(1), facts={})
        _stage(writer, lambda: None)
        decide(writer, "label", "1r", page=1)
    update(folder / INDEX, read_session(folder / VOLUME))
    save_scan(tiny_scan(9), folder / SCAN)


def _tasks(run: Run, scratch: Path) -> Iterator[tuple[str, int, Fault, Path]]:
    folder = scratch / "counted"
    _place(scratch, folder)
    code, count = count_events(lambda: _command(run, folder, lambda: None), folder)
    if code:
        sys.exit(f"{run.name} ended with {code}")
    print(f"{run.name}: {count} file events × {len(FAULTS)} faults", flush=True)
    yield from ((run.name, at, fault, scratch) for fault in FAULTS for at in range(1, count + 1))


def _place(scratch: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(scratch / "before", folder)


def _command(run: Run, folder: Path, acknowledge: Acknowledge) -> int:
    """The exit code of a run as a command has it."""
    try:
        with report_faults():
            run.work(folder, acknowledge)
    except typer.Exit as end:
        return end.exit_code
    return 0


def _judge(task: tuple[str, int, Fault, Path]) -> Verdict:
    name, at, fault, scratch = task
    run = next(run for run in RUNS if run.name == name)
    folder = scratch / f"work-{os.getpid()}"
    _place(scratch, folder)
    before = [event.line for event in read_session(folder / VOLUME).history.events]
    reader, writer = os.pipe()
    try:
        code = with_fault(lambda: _command(run, folder, lambda: _tell(writer)), folder, at, fault)
        os.close(writer)
        acknowledged = len(os.read(reader, 100))
    finally:
        os.close(reader)
    wrong = "" if code in _expected(fault) else f"exit code {code}"
    found = 0
    try:
        found, fault_found = _inspect(run, folder, before, acknowledged)
        wrong = wrong or fault_found
    except (OSError, ValueError, StationError) as error:
        wrong = wrong or f"{type(error).__name__}: {error}"
    return Verdict(run.name, fault.name, at, code, acknowledged, found, wrong)


def _tell(writer: int) -> None:
    os.write(writer, b"+")


def _expected(fault: Fault) -> tuple[int, ...]:
    if fault.name == "SIGKILL":
        return (-fault.number,)
    return (0, 128 + fault.number) if fault.number > 0 else (0, 6)


def _inspect(run: Run, folder: Path, before: Sequence[bytes], acknowledged: int) -> tuple[int, str]:
    """How many steps are found, and what is wrong with the session once it is opened again."""
    with open_session(folder / VOLUME) as writer:
        events = [event.line for event in writer.history.events]
        decide(writer, "note", "the next step", page=1)
    found = len(events) - len(before)
    if events[: len(before)] != before:
        return found, "what was there before is lost"
    if run.name in ("new", "index"):
        return found, _check_new(folder, acknowledged) if run.name == "new" else _check_index(folder)
    if not acknowledged <= found <= acknowledged + 1:
        return found, f"{acknowledged} steps were acknowledged, {found} are there"
    return found, _check_files(folder / VOLUME)


def _check_files(session: Path) -> str:
    problems = verify(session).problems
    left = WORK in [path.name for path in session.iterdir()]
    return problems[0].text if problems else ("the hidden folder is left" if left else "")


def _check_new(folder: Path, acknowledged: int) -> str:
    """What is wrong with a session that was being made, and the folder that it was made in."""
    made = folder / "another"
    if acknowledged and not made.is_dir():
        return "the session is lost"
    if not made.exists():
        create_session(made, Volume(title="Another"))
    left = [path.name for path in folder.iterdir() if path.name not in ("another", VOLUME, SCAN, WORK)]
    strays = [name for name in left if not name.startswith(INDEX)]
    return f"left behind: {strays}" if strays else _check_files(made)


def _check_index(folder: Path) -> str:
    """What is wrong with the index, as it is or once it is rebuilt."""
    try:
        sessions(folder / INDEX)
    except IndexUnusable as error:
        return str(error)
    reindex(folder / INDEX, [folder])
    entry, _ = entries_of(read_session(folder / VOLUME))
    return "" if sessions(folder / INDEX) == [entry] else "the index is not that of the session"


def _print_table(verdicts: Sequence[Verdict]) -> None:
    print(ROW.format("run", "fault", "points", "old", "new", "wrong", "exit codes"))
    groups = dict[tuple[str, str], list[Verdict]]()
    for verdict in verdicts:
        groups.setdefault((verdict.run, verdict.fault), []).append(verdict)
    for (run, fault), group in groups.items():
        new, wrong = sum(one.found > 0 for one in group), sum(bool(one.wrong) for one in group)
        codes = ", ".join(f"{code}: {count}" for code, count in sorted(Counter(one.code for one in group).items()))
        print(ROW.format(run, fault, len(group), len(group) - new, new, wrong, codes))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, help="processes; one for each processor by default")
    parser.add_argument("--only", default="", help="part of the name of a run")
    parser.add_argument("--share", type=int, default=1, help="try one point of so many")
    options = parser.parse_args()
    start_with_library()
    sys.exit(main(options.workers, options.only, options.share))

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
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import typer

from bench.kill.events import FAULTS, Fault, count_events, start_with_library, with_fault
from bench.kill.session_runs import ANOTHER, EXPORTED, INDEX, RESULTS, SCAN, STEPS, VOLUME, Acknowledge, Step, prepare
from bench.scratch import scratch_folder
from station.commands.terminal import report_faults
from station.errors import StationError
from station.session import open_session, read_session
from station.session.fixity.verify import verify
from station.session.log.steps import decide
from station.storage.folder_lock import WORK

ROW = "{:<10}{:<18}{:>7}{:>7}{:>7}{:>7}  {}"


@dataclass(frozen=True)
class Verdict:
    """What came of a fault: the exit code, the steps acknowledged and found, what is wrong."""

    step: str
    fault: str
    at: int
    code: int
    acknowledged: int
    found: int
    wrong: str


def main(workers: int | None = None, only: str = "", share: int = 1, fault: str = "") -> int:
    """Print a line for each step and fault. Returns 1 when anything is wrong.

    only, fault: parts of the names of those that are tried. share: one point of so many is tried.
    """
    start = time.perf_counter()
    with scratch_folder() as scratch:
        prepare(scratch / "before")
        chosen = [step for step in STEPS if any(part in step.name for part in only.split(","))]
        tasks = [task for step in chosen for task in _tasks(step, scratch) if fault in task[2].name][::share]
        with get_context("fork").Pool(workers or len(os.sched_getaffinity(0))) as pool:
            verdicts = pool.map(_check, tasks, chunksize=20)
    _print_table(verdicts)
    failures = [verdict for verdict in verdicts if verdict.wrong]
    for one in failures:
        print(f"  {one.step}, {one.fault} at event {one.at}: {one.wrong}")
    print(f"{len(verdicts)} points, {len(failures)} failures; {time.perf_counter() - start:.0f} s")
    return 1 if failures else 0


def _tasks(step: Step, scratch: Path) -> Iterator[tuple[str, int, Fault, Path]]:
    folder = scratch / "counted"
    _place(scratch, folder)
    code, count = count_events(lambda: _command(step, folder, lambda: None), folder)
    if code:
        sys.exit(f"{step.name} ended with {code}")
    print(f"{step.name}: {count} file events × {len(FAULTS)} faults", flush=True)
    yield from ((step.name, at, fault, scratch) for fault in FAULTS for at in range(1, count + 1))


def _place(scratch: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(scratch / "before", folder)


def _command(step: Step, folder: Path, acknowledge: Acknowledge) -> int:
    """The exit code of a step as a command has it."""
    try:
        with report_faults():
            step.work(folder, acknowledge)
    except typer.Exit as end:
        return end.exit_code
    return 0


def _check(task: tuple[str, int, Fault, Path]) -> Verdict:
    name, at, fault, scratch = task
    step = next(step for step in STEPS if step.name == name)
    folder = scratch / f"work-{os.getpid()}"
    _place(scratch, folder)
    before = [event.line for event in read_session(folder / VOLUME).history.events]
    reader, writer = os.pipe()
    try:
        code = with_fault(lambda: _command(step, folder, lambda: _acknowledge(writer)), folder, at, fault)
        os.close(writer)
        acknowledged = len(os.read(reader, 100))
    finally:
        os.close(reader)
    wrong = "" if code in _expected(fault) else f"exit code {code}"
    found = 0
    try:
        found, fault_found = _inspect(step, folder, before, acknowledged)
        wrong = wrong or fault_found
    except (OSError, ValueError, StationError) as error:
        wrong = wrong or f"{type(error).__name__}: {error}"
    return Verdict(step.name, fault.name, at, code, acknowledged, found, wrong)


def _acknowledge(writer: int) -> None:
    os.write(writer, b"+")


def _expected(fault: Fault) -> tuple[int, ...]:
    if fault.name == "SIGKILL":
        return (-fault.number,)
    return (0, 128 + fault.number) if fault.number > 0 else (0, 6)


def _inspect(step: Step, folder: Path, before: Sequence[bytes], acknowledged: int) -> tuple[int, str]:
    """How many events are found, and what is wrong with the session once it is opened again."""
    with open_session(folder / VOLUME) as writer:
        events = [event.line for event in writer.history.events]
        decide(writer, "note", "the next step", page=1)
    found, least = len(events) - len(before), 0 if step.outside else step.events * acknowledged
    if events[: len(before)] != before:
        return found, "what was there before is lost"
    if not least <= found <= least + (0 if step.outside else step.events):
        return found, f"{least} events were acknowledged, {found} are there"
    return found, _problem(folder / VOLUME) or step.check(folder, acknowledged) or _left_behind(folder)


def _problem(session: Path) -> str:
    problems = verify(session).problems
    left = WORK in [path.name for path in session.iterdir()]
    return problems[0].text if problems else ("the hidden folder is left" if left else "")


def _left_behind(folder: Path) -> str:
    """What no step makes, in the folder and in that of the batch's results."""
    known = {VOLUME, SCAN, ANOTHER, RESULTS, EXPORTED, WORK}
    strays = [path.name for path in folder.iterdir() if path.name not in known and not path.name.startswith(INDEX)]
    return f"left behind: {strays}" if strays else ""


def _print_table(verdicts: Sequence[Verdict]) -> None:
    print(ROW.format("step", "fault", "points", "old", "new", "wrong", "exit codes"))
    groups = dict[tuple[str, str], list[Verdict]]()
    for verdict in verdicts:
        groups.setdefault((verdict.step, verdict.fault), []).append(verdict)
    for (step, fault), group in groups.items():
        new, wrong = sum(one.found > 0 for one in group), sum(bool(one.wrong) for one in group)
        codes = ", ".join(f"{code}: {count}" for code, count in sorted(Counter(one.code for one in group).items()))
        print(ROW.format(step, fault, len(group), len(group) - new, new, wrong, codes))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, help="processes; one for each processor by default")
    parser.add_argument("--only", default="", help="parts of the names of steps, with commas between them")
    parser.add_argument("--fault", default="", help="part of the name of a fault: SIGKILL")
    parser.add_argument("--share", type=int, default=1, help="try one point of so many")
    options = parser.parse_args()
    start_with_library()
    sys.exit(main(options.workers, options.only, options.share, options.fault))

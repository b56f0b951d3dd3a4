"""`python -m bench.kill.power_cuts`: power cuts at every change and every flush of a session's steps.

A model of the disk takes for durable what was flushed and nothing else; what changed since is there, in part, or
absent, each file and each name by itself. What must hold is what `bench.kill.sessions` asks.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.kill.session_runs import STEPS, VOLUME, Step, prepare
from bench.scratch import scratch_folder
from oracles.power_cut import Disk, watched
from station.errors import StationError
from station.session import open_session, read_session
from station.session.fixity.verify import verify
from station.storage.folder_lock import WORK

ROW = "{:<10}{:>8}{:>8}{:>8}{:>8}"
CUT = ("capture", "again", "stage", "decide", "undo", "shift", "add")


def main(draws: int) -> int:
    """Print a line for each step. draws: random states at each point. Returns 1 when anything is wrong."""
    start, failures, total = time.perf_counter(), list[str](), 0
    print(ROW.format("step", "points", "states", "done", "wrong"))
    for step in (step for step in STEPS if step.name in CUT):
        with scratch_folder() as scratch:
            wrong = _cut(step, scratch, draws)
        states, done = wrong.pop(0)
        total += int(states)
        failures += [f"{step.name}: {text}" for _, text in wrong]
        print(ROW.format(step.name, int(states) // (draws + 1), states, done, len(wrong)), flush=True)
    print(*failures, f"{total} states, {len(failures)} failures; {time.perf_counter() - start:.0f} s", sep="\n")
    return 1 if failures else 0


def _cut(step: Step, scratch: Path, draws: int) -> list[tuple[str, str]]:
    """The number of states and of those with the step done, then what is wrong with each that is not as it must be."""
    folder, random = scratch / "session", np.random.default_rng(5)
    prepare(folder)
    before = [event.line for event in read_session(folder / VOLUME).history.events]
    counts, wrong, acknowledged = {"states": 0, "done": 0}, list[tuple[str, str]](), [0]

    def acknowledge() -> None:
        acknowledged[0] += 1

    def look(disk: Disk, event: str, _arguments: object) -> None:
        for draw in [None, *[random] * draws]:
            state = scratch / "state"
            disk.write(state, draw)
            counts["states"] += 1
            found, text = _inspect(state, before, acknowledged[0])
            counts["done"] += found > 0
            if text:
                wrong.append((event, f"at {event}, {acknowledged[0]} acknowledged: {text}"))
            shutil.rmtree(state)

    with watched(folder / VOLUME, look):
        step.work(folder, acknowledge)
    return [(str(counts["states"]), str(counts["done"])), *wrong]


def _inspect(session: Path, before: Sequence[bytes], acknowledged: int) -> tuple[int, str]:
    """How many steps are found, and what is wrong."""
    try:
        with open_session(session) as writer:
            events = [event.line for event in writer.history.events]
        problems = verify(session).problems
    except (OSError, ValueError, StationError) as error:
        return 0, f"{type(error).__name__}: {error}"
    found = len(events) - len(before)
    if events[: len(before)] != list(before) or not acknowledged <= found <= acknowledged + 1:
        return found, f"{found} steps are there"
    return found, problems[0].text if problems else ("the hidden folder is left" if (session / WORK).exists() else "")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=4)
    sys.exit(main(parser.parse_args().draws))

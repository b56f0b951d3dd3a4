"""`python -m bench.soak`: thousands of simulated captures with faults and kills; what grows is told by tenths of them.

Each round opens one of several sessions in a process of its own, captures, restores (by a stand-in), decides, undoes,
and may be killed or meet a full disk on the way. In the process that measures, further captures go into one long
session: memory, descriptors, threads and the time of a save, beside one in a new session, must not
grow. At the end the index is
rebuilt from the folders and must be the one that grew with them, and every session must be sound.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import threading
import time
from pathlib import Path

import numpy as np
import psutil

from bench.kill.events import in_child
from bench.scratch import scratch_folder
from oracles.tiny_scan import tiny_scan
from station.errors import StationError
from station.session import Volume, Writer, add_scan, create_session, open_session, read_session, undo
from station.session.fixity.verify import verify
from station.session.leaves.index import pages, reindex, sessions, update
from station.session.log.steps import decide, record_run

SESSIONS = 8
TENTHS = 10
HEAD = "{:>9}{:>12}{:>13}{:>10}{:>8}{:>10}{:>8}"
ROW = "{:>9}{:>12.1f}{:>13}{:>10}{:>8.2f}{:>10.1f}{:>8}"
# Of memory, and of the median time of a save over that in a session which is new in each tenth of the run: whatever
# else the computer does slows both, as they are done in turn.
MAX_GROWTH = 1.5


def main(captures: int) -> int:
    """Print a line for each tenth of the captures. Returns 1 when something grew, was lost or differs."""
    start, random = time.perf_counter(), np.random.default_rng(1)
    with scratch_folder() as scratch:
        root = scratch / "sessions"
        for number in range(SESSIONS + 1):
            create_session(root / f"s{number}", Volume(title=f"Volume {number}"))
        grown = _soak(root, scratch / "new", captures, random)
        wrong = [*grown, *_check(root)]
    print(*wrong, f"{captures} captures, {len(wrong)} faults; {time.perf_counter() - start:.0f} s", sep="\n")
    return 1 if wrong else 0


def _soak(root: Path, new: Path, captures: int, random: np.random.Generator) -> list[str]:
    """Run the rounds and print the table. new: a folder for the sessions to compare with. Returns what grew."""
    print(HEAD.format("captures", "memory MiB", "descriptors", "threads", "save ×", "save ms", "killed"))
    process, first, killed = psutil.Process(), dict[str, float](), 0
    last = first
    with open_session(root / "s0") as writer:
        for tenth in range(TENTHS):
            create_session(new / str(tenth), Volume(title="New"))
            seconds: dict[Writer, list[float]] = {}
            with open_session(new / str(tenth)) as beside:
                for count in range(captures // TENTHS // 2):
                    for one in (writer, beside) if count % 2 else (beside, writer):
                        seconds.setdefault(one, []).append(_timed_capture(one))
                    killed += _round(root, random)
            save, new_save = (1000 * float(np.median(seconds[one])) for one in (writer, beside))
            last = {
                "memory": process.memory_info().rss / 2**20,
                "descriptors": process.num_fds(),
                "threads": threading.active_count(),
                "save": save / new_save,
            }
            first = first or last
            print(ROW.format((tenth + 1) * captures // TENTHS, *last.values(), save, killed), flush=True)
    limits = {name: value * MAX_GROWTH if name in ("memory", "save") else value for name, value in first.items()}
    return [f"{name} grew from {first[name]:.1f} to {last[name]:.1f}" for name in first if last[name] > limits[name]]


def _timed_capture(writer: Writer) -> float:
    """Seconds that a capture takes to be stored; its page is restored after that."""
    start = time.perf_counter()
    capture = add_scan(writer, tiny_scan(len(writer.history.events)), facts={})
    seconds = time.perf_counter() - start
    _derive(writer, capture.number)
    return seconds


def _derive(writer: Writer, number: int) -> None:
    capture = writer.history.event(number)
    folder = writer.staging("run")
    folder.mkdir()
    (folder / "page.bin").write_bytes(b"a page" * 100)
    record_run(writer, "restore", capture, parameters={}, result={"size": 1}, files=folder)


def _round(root: Path, random: np.random.Generator) -> bool:
    """One round in a child process, which may be killed at any moment or meet a full disk. Returns whether it was."""
    number, seed = int(random.integers(1, SESSIONS + 1)), int(random.integers(2**31))
    fault = ("", "", "kill", "full")[random.integers(4)]
    code = in_child(lambda: _work(root / f"s{number}", root / "index", np.random.default_rng(seed), fault))
    if code not in (0, -signal.SIGKILL, 6):
        raise RuntimeError(f"a round ended with {code}")
    return code != 0


def _work(folder: Path, index: Path, random: np.random.Generator, fault: str) -> int:
    moment = int(random.integers(1, 30))
    if fault:
        _arm(fault, moment)
    try:
        with open_session(folder) as writer:
            capture = add_scan(writer, tiny_scan(moment), facts={})
            if random.integers(2):
                _derive(writer, capture.number)
            if random.integers(2):
                decide(writer, "accept", True, page=capture.page, on=capture)
            if random.integers(4) == 0:
                undo(writer)
        update(index, read_session(folder))
    except (OSError, StationError):
        return 6
    return 0


def _arm(fault: str, moment: int) -> None:
    """Kill this process, or fill the disk, at a flush to come."""
    fsync, seen = os.fsync, [0]

    def failing(descriptor: int) -> None:
        seen[0] += 1
        if seen[0] == moment:
            if fault == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            raise OSError(28, "No space left on device")
        fsync(descriptor)

    os.fsync = failing  # type: ignore[assignment]


def _check(root: Path) -> list[str]:
    """What is wrong at the end: sessions that are not sound, an index that is not the one rebuilt."""
    wrong = []
    for number in range(SESSIONS + 1):
        with open_session(root / f"s{number}") as writer:
            update(root / "index", writer.session)
        wrong += [problem.text for problem in verify(root / f"s{number}").problems]
    reindex(root / "rebuilt", [root])
    for what in (sessions, pages):
        if what(root / "index") != what(root / "rebuilt"):
            wrong.append(f"the rebuilt index has other {what.__name__}")
    shots = sum(
        event.kind == "capture" for n in range(SESSIONS + 1) for event in read_session(root / f"s{n}").history.events
    )
    print(f"{shots} captures are stored in {SESSIONS + 1} sessions")
    return wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--captures", type=int, default=2000)
    sys.exit(main(parser.parse_args().captures))

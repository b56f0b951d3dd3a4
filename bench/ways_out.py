"""`python -m bench.ways_out`: every way out of a capture, at every command, and where the laser is after it.

Signals one to five times, a disk that fills up while the conversation is recorded, kill -9 before and after every call
to the kernel, and processes that really are killed. After a signal or a full disk the laser is off; after kill -9 it is
off when any driver has started. Then a capture gives the true scan.
"""

from __future__ import annotations

import argparse
import logging
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from functools import partial
from itertools import count, islice, product
from pathlib import Path
from time import perf_counter

from drivers.safety.signals import ENDING_SIGNALS
from oracles.bus_faults import RIGS
from oracles.faults import count_commands, small_profile
from oracles.ways_out import (
    KILLED_RIGS,
    NOT_KILLED,
    ServedDevice,
    count_calls,
    ending_handlers,
    full_disk_violation,
    kill_violation,
    real_kill_violation,
    recorded_bytes,
    signal_violation,
)

MAX_SIGNALS, DISK_LIMITS = 5, 50
Cases = Generator[tuple[str, Callable[[], str]], None, None]
"""What is tried → what is wrong after it, or empty."""


def signals(transport: str) -> Cases:
    """Each ending signal, one to five times, at every command."""
    profile = small_profile()
    rig, commands = RIGS[transport](profile), count_commands(profile, RIGS[transport])
    with ending_handlers():
        for number, times, command in product(ENDING_SIGNALS, range(1, MAX_SIGNALS + 1), range(commands)):
            yield f"signal {number} × {times} at {command}", partial(signal_violation, rig, number, times, command)
    rig.close()


def full_disks(transport: str) -> Cases:
    """A disk that takes some of the recording."""
    rig = RIGS[transport](small_profile())
    with tempfile.TemporaryDirectory() as folder:
        whole = recorded_bytes(rig, Path(folder) / "whole.jsonl")
    for step in range(DISK_LIMITS):
        limit = whole * step // DISK_LIMITS
        yield f"full at {limit} of {whole} bytes", partial(full_disk_violation, rig, limit)
    rig.close()


def kills(transport: str) -> Cases:
    """Killed before or after the effect of every call to the kernel."""
    rig = KILLED_RIGS[transport](small_profile())
    for call, after in product(range(count_calls(rig)), (False, True)):
        yield f"killed {'after' if after else 'before'} call {call}", partial(kill_violation, rig, call, after=after)


def real_kills(_transport: str) -> Cases:
    """A process of its own, killed at every command of its capture."""
    served = ServedDevice()
    try:
        for command in count():
            yield f"killed at command {command}", partial(real_kill_violation, served, partial(_at, command))
    finally:
        served.close()


def _at(command: int, served: ServedDevice) -> bool:
    return served.commands == command


WAYS: dict[str, tuple[Callable[[str], Cases], tuple[str, ...]]] = {
    "signals, 1 to 5 times": (signals, tuple(RIGS)),
    "full disk": (full_disks, tuple(RIGS)),
    "kill -9": (kills, tuple(KILLED_RIGS)),
    "kill -9 of a process": (real_kills, ("socket",)),
}


def _tried(cases: Iterator[tuple[str, Callable[[], str]]]) -> Iterator[tuple[str, str]]:
    """The names of the cases with their violations, up to the first that comes after the end of the capture."""
    for name, case in cases:
        violation = case()
        if violation == NOT_KILLED:
            return
        yield name, violation


def main() -> int:
    """Print a row for each way out over each transport, then the violations. Returns 1 when there was one."""
    parser = argparse.ArgumentParser(prog="python -m bench.ways_out", description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="try only every n-th case")
    arguments = parser.parse_args()
    logging.getLogger("drivers").setLevel(logging.ERROR)  # that a recording ends is a warning each time
    columns = ["way out", "transport", "tried", "laser off and next capture true", "seconds"]
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns), flush=True)
    violations = []
    for way, (cases, transports) in WAYS.items():
        for transport in transports:
            start = perf_counter()
            with closing(cases(transport)) as every_case:
                results = list(_tried(islice(every_case, None, None, arguments.every)))
            wrong = [f"{way}, {transport}: {name}: {violation}" for name, violation in results if violation]
            right, seconds = len(results) - len(wrong), round(perf_counter() - start)
            print(f"| {way} | {transport} | {len(results)} | {right} | {seconds} |", flush=True)
            violations += wrong
    print(*violations, f"violations: {len(violations)}", sep="\n")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())

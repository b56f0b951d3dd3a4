"""`python -m bench.faults`: thousands of captures under faults, over each transport, with checksums and without.

Every command of a capture × every fault of the device, its connection and the bus, then pairs of faults up to FAULTS
captures for each transport. What must hold: the capture gives the true scan or raises a declared error, within its
deadline; laser and stage come to rest; the next capture gives the true scan.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from dataclasses import dataclass, field
from itertools import product
from time import perf_counter

from oracles.bus_faults import RIGS
from oracles.faults import count_commands, pair_injections, single_injections, small_profile, without_checksums

CAPTURES, FEWEST_PAIRS, SEED = 3000, 100, 1
PROFILES = {"checksums": lambda: small_profile(), "no checksums": lambda: without_checksums(small_profile())}
RULES = {  # column of the table → beginnings of the violations that it counts
    "wrong accepted": ("range and colour", "an earlier shot", "samples are missing"),
    "too long": ("it took",),
    "not at rest": ("the laser", "the stage"),
    "next wrong": ("the next capture", "next capture"),
    "undeclared": ("no hint",),
}


@dataclass
class Cell:
    """The captures over one transport with one kind of profile."""

    commands: int = 0
    outcomes: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def captures(self) -> int:
        """Number of captures."""
        return sum(self.outcomes.values())

    def broken(self) -> Counter[str]:
        """Number of violations in each column of RULES."""
        return Counter(_column(violation.split(": ", 1)[1]) for violation in self.violations)


def run(transport: str, checksums: str, captures: int) -> Cell:
    """Run one cell of the matrix."""
    profile, kind, start = PROFILES[checksums](), RIGS[transport], perf_counter()
    cell = Cell(count_commands(profile, kind))
    singles = list(single_injections(kind, cell.commands))
    pairs = max(captures - len(singles), FEWEST_PAIRS)
    rig = kind(profile)
    for injection in [*singles, *pair_injections(kind, cell.commands, pairs, random.Random(SEED))]:
        verdict = rig.inject(injection)
        cell.outcomes[verdict.outcome] += 1
        if verdict.violation:
            places = sorted({*injection.device, *injection.bus})
            cell.violations.append(f"{injection.name} at {places}: {verdict.violation}")
            rig = kind(profile)
    cell.seconds = perf_counter() - start
    return cell


def main() -> int:
    """Print the table, and every violation below it. Returns 1 when there was one."""
    parser = argparse.ArgumentParser(prog="python -m bench.faults", description=__doc__)
    parser.add_argument("--over", choices=RIGS, action="append", help="transport; all of them unless told")
    parser.add_argument("--profile", choices=PROFILES, action="append", help="kind of profile; both unless told")
    parser.add_argument("--captures", type=int, default=CAPTURES, help="least number of captures of a cell")
    arguments = parser.parse_args()
    columns = ["transport", "profile", "commands", "captures", "true scans", "declared errors", *RULES, "seconds"]
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns), flush=True)
    violations = []
    for transport, checksums in product(arguments.over or RIGS, arguments.profile or PROFILES):
        cell = run(transport, checksums, arguments.captures)
        broken, scans = cell.broken(), cell.outcomes["scan"]
        errors = cell.captures - scans - cell.outcomes["escaped"]
        row = [transport, checksums, cell.commands, cell.captures, scans, errors, *(broken[rule] for rule in RULES)]
        print("| " + " | ".join(map(str, [*row, round(cell.seconds)])) + " |", flush=True)
        violations += [f"{transport}, {checksums}: {violation}" for violation in cell.violations]
    print(*violations, f"violations: {len(violations)}", sep="\n")
    return 1 if violations else 0


def _column(violation: str) -> str:
    named = (column for column, beginnings in RULES.items() if violation.startswith(beginnings))
    return next(named, "undeclared")


if __name__ == "__main__":
    sys.exit(main())

"""`python -m bench.faults`: every command of a capture × every fault, and a sample of pairs, over the real driver.

What must hold: the capture gives the true scan or raises a declared error, in bounded time and commands; the device
comes to rest; the next capture gives the true scan.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from time import perf_counter

from drivers.simulated.faults import FAULTS
from oracles.faults import FaultRig, count_commands, fault_pairs, single_faults, small_profile

PAIRS, SEED = 400, 1


def main() -> int:
    """Print what came of each fault, then the counts. Returns 1 when anything was wrong."""
    profile, start = small_profile(), perf_counter()
    commands = count_commands(profile)
    rig, bad, table = FaultRig(profile), list[str](), dict[str, Counter[str]]()
    for name, script in single_faults(commands):
        verdict = rig.run(script)
        table.setdefault(name, Counter())[verdict.outcome] += 1
        bad += [f"{name} at command {min(script)}: {verdict.violation}"] if verdict.violation else []
    print(f"one fault: {commands} commands × {len(FAULTS)} faults = {commands * len(FAULTS)} captures")
    for name, outcomes in table.items():
        print(f"  {name:<22}", ", ".join(f"{outcome} {count}" for outcome, count in outcomes.most_common()))
    both = Counter[str]()
    for name, script in fault_pairs(commands, PAIRS, random.Random(SEED)):
        verdict = rig.run(script)
        both[verdict.outcome] += 1
        bad += [f"{name} at commands {sorted(script)}: {verdict.violation}"] if verdict.violation else []
    print(f"two faults: {PAIRS} captures:", ", ".join(f"{outcome} {count}" for outcome, count in both.most_common()))
    print(f"wrong: {len(bad)}; {perf_counter() - start:.0f} s", *bad, sep="\n  ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

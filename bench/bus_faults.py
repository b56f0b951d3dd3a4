"""`python -m bench.bus_faults`: every command of a capture × every fault of the USB bus, below the real transport.

What must hold is what `oracles.faults` checks; only that the faults are those of Bulk-Only: halts, phase errors, lost,
damaged and doubled status wrappers, data too short and too long, silence, a pulled plug.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import product
from time import perf_counter

from drivers.simulated.buses.bulk_only_device import FAULTS
from oracles.bus_faults import BusFaultRig, count_commands
from oracles.faults import small_profile


def main() -> int:
    """Print what came of each fault, then the count. Returns 1 when anything was wrong."""
    profile, start = small_profile(), perf_counter()
    commands = count_commands(profile)
    rig, bad, table = BusFaultRig(profile), list[str](), dict[str, Counter[str]]()
    for fault, at in product(FAULTS, range(commands)):
        verdict = rig.run_bus({at: fault})
        table.setdefault(fault, Counter())[verdict.outcome] += 1
        bad += [f"{fault} at command {at}: {verdict.violation}"] if verdict.violation else []
    print(f"one fault: {commands} commands × {len(FAULTS)} faults = {commands * len(FAULTS)} captures")
    for fault, outcomes in table.items():
        print(f"  {fault:<24}", ", ".join(f"{outcome} {count}" for outcome, count in outcomes.most_common()))
    print(f"wrong: {len(bad)}; {perf_counter() - start:.0f} s", *bad, sep="\n  ")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

"""`python -m bench.hostile [--files 20000] [--seed S]`: damaged files of every kind, and what came of each.

What must hold for every file: no exit code 1, no signal, at most 10 s of processor time for each MB (of a file below
1 MB, 10 s), at most 12 times its size and 200 MB above the idle process, no file left behind.
"""

from __future__ import annotations

import argparse
import os
import secrets
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

from bench.hostile.pool import Examples, Verdict, run
from bench.hostile.readers import readers

FILES = 20_000
PROGRESS = 1000  # files between two lines of progress
BOUNDS = ("exit 1", "signal", "time", "memory", "files left")
ROW = "{:<18}{:>7}{:>7}{:>9}" + "{:>8}" * 4 + "{:>11}" + "{:>9}{:>10}"


def main(files: int = FILES, seed: int | None = None, workers: int | None = None, first: int = 0) -> int:
    """Print a line for each reader and one for all. Returns 1 when a bound was broken."""
    seed = secrets.randbits(32) if seed is None else seed
    workers = workers or len(os.sched_getaffinity(0))
    print(f"{files} files, seed {seed}, {workers} processes", flush=True)
    start, verdicts = time.perf_counter(), list[Verdict]()
    with tempfile.TemporaryDirectory() as name:
        examples = Examples(readers(), seed, Path(name))
        examples.read_sound()
        for verdict in run(examples, iter(range(first, first + files)), workers, Path(name)):
            verdicts.append(verdict)
            if len(verdicts) % PROGRESS == 0:
                print(f"  {len(verdicts)} files after {time.perf_counter() - start:.0f} s", flush=True)
            if verdict.violations:
                what = f"{', '.join(verdict.violations)}: {verdict.reader} {verdict.size:.3f} MB, exit {verdict.code}"
                what += f", signal {verdict.signal}, {verdict.seconds:.1f} s, {verdict.growth:.0f} MB {verdict.left}"
                print(f"  {what} {verdict.fault} (--seed {seed} --first {verdict.index} --files 1)", flush=True)
    _print_table(verdicts)
    print(f"{time.perf_counter() - start:.0f} s")
    return 1 if any(verdict.violations for verdict in verdicts) else 0


def _print_table(verdicts: Sequence[Verdict]) -> None:
    print(ROW.format("reader", "files", "read", "refused", *BOUNDS, "max s", "max MB"))
    groups = defaultdict[str, list[Verdict]](list)
    for verdict in verdicts:
        groups[verdict.reader].append(verdict)
    for name, group in [*groups.items(), ("all", verdicts)]:
        read = sum(verdict.code == 0 for verdict in group)
        broken = [sum(bound in verdict.violations for verdict in group) for bound in BOUNDS]
        most = max(verdict.seconds for verdict in group), max(verdict.growth for verdict in group)
        print(ROW.format(name, len(group), read, len(group) - read, *broken, f"{most[0]:.1f}", f"{most[1]:.0f}"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=FILES)
    parser.add_argument("--seed", type=int, help="of an earlier run; a fresh one by default")
    parser.add_argument("--first", type=int, default=0, help="number of the first file: finds one again")
    parser.add_argument("--workers", type=int, help="processes; one for each processor by default")
    options = parser.parse_args()
    sys.exit(main(options.files, options.seed, options.workers, options.first))

"""Show where the processor time of a page goes (`bench.profile`).

With one thread, each page is restored in a process of its own, as a worker of a batch does it: the first restoration
loads the kernels, further ones show what a page costs, and one more is profiled. Printed are the functions of this
package that take a fraction of LEAST or more: with all that they call, and by themselves. The profile makes short
functions look longer.
"""

from __future__ import annotations

import argparse
import cProfile
import os
import pstats
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from station.workers.process import THREADS

LEAST = 0.02
REPEATS = 3
ROOT = Path(__file__).parent.parent
SEED = 5
PARTS = ("restore", "station", "drivers")


def main() -> None:
    """Print a table for each mode of the scanner and each resolution."""
    parser = argparse.ArgumentParser(prog="python -m bench.profile", description=__doc__)
    parser.add_argument("--modes", nargs="+", default=["fine", "fast"], choices=["fine", "fast"])
    parser.add_argument("--dpi", type=float, nargs="+", default=[150.0, 300.0, 600.0])
    parser.add_argument("--scan", type=Path, help="a scan to profile in place of simulated ones")
    parser.add_argument("--here", action="store_true", help="in this process, with its threads")
    chosen = parser.parse_args()
    if chosen.here:
        for dpi in chosen.dpi:
            profile_page(chosen.scan, dpi)
        return
    with tempfile.TemporaryDirectory() as name:
        for scan in [chosen.scan] if chosen.scan else [_simulated(mode, Path(name)) for mode in chosen.modes]:
            for dpi in chosen.dpi:
                words = [sys.executable, "-m", "bench.profile", "--here", "--scan", str(scan), "--dpi", str(dpi)]
                subprocess.run(words, check=True, env=os.environ | dict.fromkeys(THREADS, "1"))


def _simulated(mode: str, folder: Path) -> Path:
    from drivers.simulated import Curl, shoot
    from restore import save_scan

    scan = folder / f"{mode}.scan"
    save_scan(shoot(Curl(), seed=SEED, mode=mode)[0], scan)
    return scan


def profile_page(scan: Path, dpi: float) -> None:
    """Print what a page costs in this process, and its profile."""
    from restore import Settings
    from station.run.destination import Destination
    from station.run.one_page import restore_file
    from station.run.options import RunOptions

    def restore_page() -> None:
        with tempfile.TemporaryDirectory() as folder:
            restore_file(scan, Destination(Path(folder)), RunOptions(settings=Settings(dpi=dpi)))

    first = _seconds(restore_page)
    page = statistics.median(_seconds(restore_page) for _ in range(REPEATS))
    profile = cProfile.Profile(time.process_time)
    profile.runcall(restore_page)
    print(f"{scan.stem}, {dpi:.0f} dpi: {page:.2f} s of processor time a page; the first {first:.2f}")
    for share, own, name in shares(pstats.Stats(profile)):
        print(f"{share:6.1%} {own:6.1%}  {name}")
    print(flush=True)


def _seconds(work: Callable[[], None]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def shares(stats: pstats.Stats) -> list[tuple[float, float, str]]:
    """Return the functions that take LEAST of the time or more.

    Of each: the fraction with all that it calls, that by itself, and its name.
    """
    table, whole = stats.stats, stats.total_tt  # type: ignore[attr-defined]
    found = []
    for (file, line, function), (_, _, own, total, _) in table.items():
        name = Path(file)
        ours = name.is_relative_to(ROOT) and name.relative_to(ROOT).parts[0] in PARTS
        if ours and total >= LEAST * whole:
            found.append((total / whole, own / whole, f"{name.relative_to(ROOT)}:{line} {function}"))
    return sorted(found, reverse=True)


if __name__ == "__main__":
    main()

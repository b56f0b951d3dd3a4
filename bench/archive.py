"""Measure pages in a batch and at archive resolutions (`bench.archive`).

Single restorations of a FINE and a FAST page at several resolutions, then a batch of mixed pages with one worker and
with two, each as a command: wall and processor seconds, and the largest memory of any of its processes. With other
sources of the program, such as a worktree of an earlier commit, every run of one is followed by one of the other, and
the last column is the median of the ratios pair by pair: a busy machine is busy for both.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Literal

from drivers.simulated import Binding, Curl, MultiFold, Wave, shoot
from restore import save_scan

ROOT = Path(__file__).parent.parent
SHEETS = (Curl(), Binding(), MultiFold(), Wave())
MODES = ("fine", "fast")
RUN = "import sys; from station.cli import main; sys.exit(main(sys.argv[1:]))"
ROW = "{:<22}{:>10}{:>12}{:>12}{:>10}{:>28}"


@dataclass(frozen=True)
class Cost:
    """Seconds of a command, and the memory of its largest process in MB."""

    wall_s: float
    processor_s: float
    memory_mb: float


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m bench.archive", description=__doc__)
    parser.add_argument("--against", type=Path, help="the folder of other sources")
    parser.add_argument("--pages", type=int, default=24, help="of the batch, 0 for none")
    parser.add_argument("--dpi", type=float, nargs="+", default=[150.0, 300.0, 600.0])
    parser.add_argument("--modes", nargs="+", default=MODES, choices=MODES)
    parser.add_argument("--repeats", type=int, default=3, help="of the single restorations, after one to warm up")
    chosen = parser.parse_args()
    trees = [ROOT, *([chosen.against.resolve()] if chosen.against else [])]
    print(ROW.format("", "sources", "wall s", "processor s", "memory MB", "wall, processor, memory of other"))
    # Elsewhere: a command starts with the memory of the process that starts it counted as its own.
    maker = ProcessPoolExecutor(1, get_context("spawn"))
    with tempfile.TemporaryDirectory() as name, maker:
        folder = Path(name)
        for mode in chosen.modes:
            scan = folder / f"{mode}.scan"
            maker.submit(write_scan, scan, 0, mode).result()
            for dpi in chosen.dpi:
                words = ["restore", str(scan), "--dpi", str(dpi)]
                pairs = [[run(tree, words) for tree in trees] for _ in range(chosen.repeats + 1)][1:]
                _print(f"{mode}, {dpi:.0f} dpi", pairs)
        if chosen.pages:
            scans = maker.submit(mixed_pages, folder / "scans", chosen.pages).result()
            for workers in (1, 2):
                words = ["batch", str(scans)]
                pairs = [[run(tree, [*words, *_workers(tree, workers)]) for tree in trees]]
                _print(f"{chosen.pages} pages, {workers} worker{'s'[: workers - 1]}", pairs)


def mixed_pages(folder: Path, count: int) -> Path:
    """A folder of so many scans, of several sheets, FINE and FAST in turn."""
    for number in range(count):
        write_scan(folder / f"page{number:03}.scan", number, MODES[number % len(MODES)])
    return folder


def write_scan(path: Path, number: int, mode: Literal["fine", "fast"]) -> None:
    """Write the scan of the sheet with this number."""
    save_scan(shoot(SHEETS[number // len(MODES) % len(SHEETS)], seed=number, mode=mode)[0], path)


def _workers(tree: Path, count: int) -> list[str]:
    """Return the option for the workers, which was renamed with the folder."""
    return ["--jobs" if (tree / "station" / "commands").is_dir() else "--workers", str(count)]


def run(tree: Path, words: Sequence[str]) -> Cost:
    """Run a command of the sources in a folder; its results are removed."""
    with tempfile.TemporaryDirectory() as out:
        start = time.perf_counter()
        command = [sys.executable, "-c", RUN, *words, "-o", out]
        process = subprocess.Popen(
            command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, stdout=subprocess.DEVNULL
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise subprocess.CalledProcessError(process.returncode, command)
        return Cost(time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024)


def _print(title: str, pairs: list[list[Cost]]) -> None:
    """Print a line for each of the sources.

    pairs: for each repetition the cost of each of them.
    """
    for number, name in enumerate(("these", "other")[: len(pairs[0])]):
        costs = [pair[number] for pair in pairs]
        medians = [statistics.median(getattr(cost, field) for cost in costs) for field in Cost.__dataclass_fields__]
        ratios = ""
        if number == 0 and len(pairs[0]) > 1:
            ratios = "  ".join(
                f"{statistics.median(getattr(a, field) / getattr(b, field) for a, b in pairs):.2f}"
                for field in Cost.__dataclass_fields__
            )
        wall, processor, memory = medians
        print(ROW.format(title, name, f"{wall:.2f}", f"{processor:.2f}", f"{memory:.0f}", ratios), flush=True)


if __name__ == "__main__":
    main()

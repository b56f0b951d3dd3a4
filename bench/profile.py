"""Show where the processor time of a page goes (`bench.profile`).

With one thread, each page is restored in a process of its own, as a worker of a batch does it: the first restoration
loads the kernels, further ones show what a page costs, and one more is profiled. Printed are the functions of this
package that take a fraction of LEAST or more: with all that they call, and by themselves. The profile makes short
functions look longer. With `--write-docs` the stages of a page at 150 dpi go to bench/results/stages.md.
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
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from station.workers.process import THREADS

LEAST = 0.02
REPEATS = 3
ROOT = Path(__file__).parent.parent
SEED = 5
PARTS = ("restore", "station", "drivers")
RESULTS = Path(__file__).parent / "results" / "stages.md"
HEAD = """# What a page costs, stage by stage

`python -m bench.profile --write-docs`: a simulated page of text, restored again and again in one process with one
thread, 150 dpi; per cent of its processor time.

"""
# What the station and the restoration do one after the other, by the functions that do it.
STAGES = {
    "reading the scan": ("load_capture",),
    "separating the page from the table": ("select_sheets",),
    "facets": ("fit_facets",),
    "else of preparing": ("prepare",),
    "decimation": ("decimate_sheet",),
    "flattening": ("flatten_with_lengths",),
    "finer mesh": ("refine", "subdivide"),
    "straight sides": ("straighten",),
    "painting": ("paint_page",),
    "coverage": ("kinds_on", "cover", "seen_part"),
    "MTF50": ("texture_mtf50",),
    "PNG": ("write_png",),
}
PARTS_OF = {"else of preparing": "facets"}  # a stage → the one within it, which is listed by itself


def main() -> None:
    """Print a table for each mode of the scanner and each resolution."""
    parser = argparse.ArgumentParser(prog="python -m bench.profile", description=__doc__)
    parser.add_argument("--modes", nargs="+", default=["fine", "fast"], choices=["fine", "fast"])
    parser.add_argument("--dpi", type=float, nargs="+", default=[150.0, 300.0, 600.0])
    parser.add_argument("--scan", type=Path, help="a scan to profile in place of simulated ones")
    parser.add_argument("--here", action="store_true", help="in this process, with its threads")
    parser.add_argument("--write-docs", action="store_true", help="write the stages at 150 dpi to bench/results")
    chosen = parser.parse_args()
    if chosen.here:
        for dpi in chosen.dpi:
            profile_page(chosen.scan, dpi)
        return
    if chosen.write_docs:
        with ProcessPoolExecutor(1, get_context("spawn")) as alone:
            RESULTS.write_text(HEAD + alone.submit(stages_table, ("fine", "fast")).result())
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
    first, page, stats = _profiled(scan, dpi)
    print(f"{scan.stem}, {dpi:.0f} dpi: {page:.2f} s of processor time a page; the first {first:.2f}")
    for share, own, name in shares(stats):
        print(f"{share:6.1%} {own:6.1%}  {name}")
    print(flush=True)


def stages_table(modes: Sequence[str]) -> str:
    """Return the stages of a page in each mode of the scanner, as a table in Markdown.

    In a process of its own, where nothing is imported yet.
    """
    os.environ.update(dict.fromkeys(THREADS, "1"))
    columns: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as name:
        for mode in modes:
            _, page, stats = _profiled(_simulated(mode, Path(name)), 150.0)
            columns[f"{mode.upper()}, {page:.2f} s"] = stages(stats)
    lines = [["", *columns], ["---"] * (1 + len(columns))]
    lines += [[stage, *(f"{of[stage]:.0%}" for of in columns.values())] for stage in [*STAGES, "all else"]]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def stages(stats: pstats.Stats) -> dict[str, float]:
    """Return the fraction of the time that each of STAGES takes, and `all else`."""
    table, whole = stats.stats, stats.total_tt  # type: ignore[attr-defined]
    total: Counter[str] = Counter()
    for (file, _, function), (_, _, _, seconds, _) in table.items():
        if _is_ours(Path(file)):
            total[function] = max(total[function], seconds)
    found = {stage: sum(total[function] for function in names) / whole for stage, names in STAGES.items()}
    found |= {stage: found[stage] - found[within] for stage, within in PARTS_OF.items()}
    return found | {"all else": 1.0 - sum(found.values())}


def _profiled(scan: Path, dpi: float) -> tuple[float, float, pstats.Stats]:
    """Restore a page; return seconds of the first time, of a later one, and the profile of one more."""
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
    return first, page, pstats.Stats(profile)


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
        if _is_ours(Path(file)) and total >= LEAST * whole:
            found.append((total / whole, own / whole, f"{Path(file).relative_to(ROOT)}:{line} {function}"))
    return sorted(found, reverse=True)


def _is_ours(file: Path) -> bool:
    return file.is_relative_to(ROOT) and file.relative_to(ROOT).parts[0] in PARTS


if __name__ == "__main__":
    main()

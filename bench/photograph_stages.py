"""`python -m bench.photograph_stages [--sheet wave] [--seed S] [--width 4000] [--views 10] [--folder F]`: its cost.

Photographs of a printed page, a kind of `bench.photographs`, are taken in the simulated world and written as JPEG
files, or are those of a folder. A process of its own reads them and restores the page at 150 dpi, after a set of small
ones that has compiled what there is to compile. For each stage the seconds by the clock and by the processors are
printed, and the peak of the process's memory up to its end; then how right the page is, and how finely it is resolved
when it is painted at 400 dpi: the effective pixels per inch of its own edges beside those that the edges in the
photographs have there (ISO 12233). The clock tells something only where nothing else runs.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from bench.draws import seed_of_today
from bench.memory import status_mb
from bench.photographs import SHEETS, compared, photographed
from drivers.simulated import Curl
from oracles.markers import rigid_residual
from oracles.simulation.photographs import PhotographSet, Shots, views_from
from restore import RestoredPage, Settings, reconstruct_page, restore
from restore.photo import read_photograph
from restore.photogrammetry import PhotographedPage
from restore.texture.resolution import print_or_outline_mtf50

WARM_WIDTH, WARM_VIEWS = 1000, 4
FINE_DPI = 400.0  # more than photographs of 12 megapixels hold of such a page
ROW = "{:<12} {:>8} {:>8} {:>8}"


@dataclass
class Stages:
    """Seconds by the clock and by the processors, and the peak of memory in MB, of each stage in its order."""

    table: dict[str, list[float]] = field(default_factory=dict)
    running: str = "read"
    before: tuple[float, float] = field(default_factory=lambda: (time.perf_counter(), time.process_time()))

    def progress(self, stage: str, done: float) -> None:
        """What the steps report: the time since the last report belongs to the stage that was running then."""
        now = time.perf_counter(), time.process_time()
        row = self.table.setdefault(self.running, [0.0, 0.0, 0.0])
        row[:] = row[0] + now[0] - self.before[0], row[1] + now[1] - self.before[1], status_mb("VmHWM")
        self.before, self.running = now, "between" if done >= 1.0 else stage


def main(sheet: str, seed: int | None, width: int, views: int, folder: Path | None) -> None:
    """Print a line for each stage, the total, and how right and how fine the page is."""
    if folder is not None:
        _measure(sorted(folder.iterdir()))
        return
    seed = seed or seed_of_today()
    drawn = SHEETS[sheet].draw(np.random.default_rng(seed))
    print(f"{sheet}: {views} photographs of {width} × {width * 3 // 4}, seed {seed}")
    taken = photographed(drawn, seed, views, Shots(size=(width, width * 3 // 4)))
    with tempfile.TemporaryDirectory(prefix="planish-") as name:
        paths = _saved(taken, Path(name) / "set")
        page, names = _measure(paths)
    shown = views_from(taken, [paths.index(path) for path in names])
    error, scale = rigid_residual(*compared(page, list(range(len(names))), shown))
    print(f"rms {np.sqrt((error**2).sum(axis=1).mean()):.3f} mm, scale {scale - 1:+.3%}")


def _measure(paths: list[Path]) -> tuple[RestoredPage, list[Path]]:
    """Print what the photographs of files cost; the page at 150 dpi, and the files that joined."""
    warm = photographed(Curl(radius_mm=250.0), 1, WARM_VIEWS, Shots(size=(WARM_WIDTH, WARM_WIDTH * 3 // 4)))
    with tempfile.TemporaryDirectory(prefix="planish-") as name, get_context("spawn").Pool(1) as pool:
        table, page, fine, names = pool.apply(_run, (_saved(warm, Path(name) / "warm"), paths))
    print(f"{len(names)} of {len(paths)} photographs joined")
    print(ROW.format("stage", "s", "cpu s", "peak MB"))
    for stage, row in table.items():
        print(ROW.format(stage, *(f"{value:.1f}" for value in row[:2]), f"{row[2]:.0f}"))
    whole = np.array(list(table.values()))
    print(ROW.format("whole", *(f"{value:.1f}" for value in whole[:, :2].sum(axis=0)), f"{whole[:, 2].max():.0f}"))
    mtf50 = print_or_outline_mtf50(fine.image, fine.mask)
    held, kept = fine.report["resolved_ppi"], 2.0 * (mtf50 or 0.0) * FINE_DPI
    print(f"{kept:.0f} of {held:.0f} pixels per inch: {kept / held:.1%}")
    return page, names


def _saved(taken: PhotographSet, folder: Path) -> list[Path]:
    folder.mkdir()
    return taken.save(folder)


def _run(warm: list[Path], paths: list[Path]) -> tuple[dict[str, list[float]], RestoredPage, RestoredPage, list[Path]]:
    """The stages of a set, its page at 150 dpi and at FINE_DPI, and the photographs that joined."""
    _restored(warm, Stages())
    stages = Stages()
    page, restored = _restored(paths, stages)
    names = {one.name for one in page.photographs}
    fine = restore(page.mesh, Settings(dpi=FINE_DPI), photos=page.photographs)
    return stages.table, restored, fine, [path for path in paths if path.name in names]


def _restored(paths: list[Path], stages: Stages) -> tuple[PhotographedPage, RestoredPage]:
    photographs = [read_photograph(path) for path in paths]
    page = reconstruct_page(photographs, progress=stages.progress)
    restored = restore(page.mesh, Settings(), photos=page.photographs, progress=stages.progress)
    stages.progress("end", 1.0)
    return page, restored


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sheet", choices=tuple(SHEETS), default="wave")
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=4000)
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--folder", type=Path, help="photographs to use instead of simulated ones")
    options = parser.parse_args()
    main(options.sheet, options.seed, options.width, options.views, options.folder)

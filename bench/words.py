"""Words read on 52 simulated pages: raw picture, restored page, restored page without its light, flat original.

    python -m bench.words [--pages 14] [--workers 2]

The paper's Table 1, over its mix of warps, with about its 12,000 words. Every page is 230 × 160 mm of running text
before the MIDDLE lens at 0.9 m, 53 pixels to the inch; the size of the type is such that the raw pictures read as badly
as the paper's (51 to 89 % of the words). The flat original is the ceiling: the same print laid flat, seen by the same
camera. All four are read alike, by Tesseract, as `planish ocr` reads a page. Precision as in `station.ocr_precision`.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from drivers.simulated import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Pose, Text, Truth, Wave, shoot
from drivers.simulated.sheets import Sheet
from drivers.vivid900.calibration import nominal
from drivers.vivid900.lenses import LENSES
from drivers.vivid900.triangulation import project
from oracles.similarity import align_page, page_similarity
from restore import RangeScan, Settings, restore
from restore.scan import Bytes
from restore.texture.page import MM_PER_INCH, sample
from station.ocr_precision import MatchCount, count_matching_characters, count_matching_words
from station.words import ProgramMissing, find_tesseract, recognise

LENS, DISTANCE_MM = "MIDDLE", 900.0  # as in the paper's experiments
PAGE_MM = (230.0, 160.0)
DPI = 150.0
TILT_DEG = 10.0  # books lie on a stand: it is from there that their lines look curved
TYPE_PT, TITLE_PT, MARGIN_MM = 14.0, 24.0, 13.0

# 52 pages: how each kind of sheet varies.
WARPS: dict[str, tuple[Sheet, ...]] = {
    "rolling curl": tuple(Curl(radius_mm=r, angle_deg=a) for r in (130.0, 145.0, 160.0) for a in (-15.0, 10.0, 20.0)),
    "binding curl": tuple(Binding(slope_deg=s, reach_mm=r) for s in (52.0, 55.0, 58.0) for r in (35.0, 42.0, 50.0)),
    "multi-fold": tuple(
        MultiFold(creases=((-62.0, lean, fold), (-5.0, -lean * 0.7, -fold - 8), (58.0, lean, fold - 4)))
        for lean in (-8.0, 5.0, 9.0)
        for fold in (34.0, 37.0, 40.0)
    ),
    "rumples": tuple(
        Wave(slope_deg=s, wavelength_mm=w, angle_deg=a)
        for s, w, a in (
            (24.0, 120.0, 25.0),
            (26.0, 130.0, 25.0),
            (27.0, 140.0, 40.0),
            (26.0, 110.0, 15.0),
            (25.0, 110.0, -20.0),
            (26.0, 150.0, 60.0),
            (25.0, 120.0, -30.0),
        )
    ),
    "cone": tuple(Cone(apex_mm=250.0, opening_deg=o, angle_deg=a) for o in (34.0, 36.0, 38.0) for a in (20.0, -30.0)),
    "Miura fold": tuple(Miura(fold_deg=f, acute_deg=a) for f in (26.0, 27.5, 29.0) for a in (70.0, 74.0)),
    "crumpled": tuple(Crumpled(seed=seed, tilt_deg=8.0) for seed in range(6)),
}
COLUMNS = ("raw", "restored", "light removed", "flat")
MAX_DEFICIT_WORDS, MAX_DEFICIT_CHARACTERS = 2.0, 1.0  # points below the flat original
MIN_GAIN_WORDS, MIN_GAIN_CHARACTERS = 18.8, 16.5  # points over the raw picture, on average: the paper's gains
MIN_MS_SSIM = 0.95  # MS-SSIM; flattened photographs reach 0.60 to 0.82


@dataclass(frozen=True)
class Task:
    """One page of the bench."""

    warp: str
    sheet: Sheet
    seed: int


@dataclass(frozen=True)
class Result:
    """Precision in the pictures of COLUMNS, and MS-SSIM with the flat original: of the page without its light as it is,
    of the page with its light aligned to the original, and of the page without its light aligned."""

    warp: str
    words: tuple[MatchCount, ...]
    characters: tuple[MatchCount, ...]
    ms_ssim: tuple[float, float, float]
    printed: int


@dataclass(frozen=True, eq=False)
class Pictures:
    """The pictures of a page (h, w, 3) uint8 by the names of COLUMNS, their resolutions, and what is printed on it."""

    images: dict[str, Bytes]
    dpi: dict[str, float]
    text: str


def tasks() -> list[Task]:
    """All pages, every one with other sentences."""
    return [
        Task(warp, sheet, 100 * k + i)
        for k, (warp, sheets) in enumerate(WARPS.items())
        for i, sheet in enumerate(sheets)
    ]


def evenly_chosen(pages: Sequence[Task], count: int) -> list[Task]:
    """`count` of the pages, evenly spaced over the warps."""
    return [pages[i] for i in np.unique(np.linspace(0, len(pages) - 1, count).round().astype(int))]


def pictures(task: Task) -> Pictures:
    """Shoot, restore, and shoot the flat original."""
    print_ = Text(title_pt=TITLE_PT, sizes_pt=(TYPE_PT,), margin_mm=MARGIN_MM, seed=task.seed)
    optics = {"lens": LENS, "distance_mm": DISTANCE_MM, "page_mm": PAGE_MM}
    scan, truth = shoot(task.sheet, print_, seed=task.seed, pose=Pose(tilt_deg=TILT_DEG), **optics)
    flat, flat_truth = shoot(Flat(), print_, seed=task.seed, **optics)
    page = restore(scan, Settings(dpi=DPI, shading="remove"))
    images = (cropped(scan, truth), page.master, page.image, laid_flat(flat, flat_truth))
    raw_dpi = LENSES[LENS].focal_px / (DISTANCE_MM + LENSES[LENS].pupil_mm) * MM_PER_INCH
    return Pictures(
        dict(zip(COLUMNS, images, strict=True)),
        dict(zip(COLUMNS, (raw_dpi, DPI, DPI, DPI), strict=True)),
        " ".join(word.text for word in truth.words),
    )


def cropped(scan: RangeScan, truth: Truth) -> Bytes:
    """The part of the colour image that the page is in: the table beside it is spared the reader."""
    seen = project(nominal(LENSES[LENS]), truth.surface(_grid(truth, 60.0)))
    height, width = scan.texture.shape[:2]
    left, top = np.clip(np.floor(seen.min(axis=(0, 1))).astype(int), 0, [width, height])
    right, bottom = np.clip(np.ceil(seen.max(axis=(0, 1))).astype(int) + 1, 0, [width, height])
    return scan.texture[top:bottom, left:right]


def laid_flat(scan: RangeScan, truth: Truth) -> Bytes:
    """The page as the picture shows it, by its true place, at DPI."""
    return sample(scan.texture, project(nominal(LENSES[LENS]), truth.surface(_grid(truth, DPI))).astype(np.float32))


def _grid(truth: Truth, dpi: float) -> np.ndarray:
    """(h, w, 2) mm on the page of the middles of its pixels at `dpi`."""
    step, (width, height) = MM_PER_INCH / dpi, truth.page_mm
    x, y = (np.arange(round(side / step)) + 0.5 for side in (width, height))
    return np.stack(np.meshgrid(x * step, height - y * step), axis=-1)


def measure(task: Task) -> Result:
    """Read all pictures of a page."""
    seen = pictures(task)
    texts = [recognise(seen.images[name], seen.dpi[name], name=name).text for name in COLUMNS]
    words, characters = (
        tuple(count(seen.text, text) for text in texts) for count in (count_matching_words, count_matching_characters)
    )
    flat = seen.images["flat"]
    kept, removed = (align_page(seen.images[name], flat) for name in ("restored", "light removed"))
    ms_ssim = tuple(page_similarity(page, flat) for page in (seen.images["light removed"], kept, removed))
    return Result(task.warp, words, characters, ms_ssim, len(seen.text.split()))


def measured(pages: Sequence[Task], workers: int) -> Iterator[Result]:
    """The results in the order of the pages, by several processes."""
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=_limit_to_one_thread) as pool:
        yield from pool.map(measure, pages)


def _limit_to_one_thread() -> None:
    os.environ["OMP_THREAD_LIMIT"] = "1"  # Tesseract's own threads would only be in the way of the other pages


ROW = "{:<14}{:>6}" + "{:>16}" * 4 + "{:>24}"


def table(results: Sequence[Result]) -> Iterator[str]:
    """A line a warp and one for all: precision of words / characters in per cent, MS-SSIM.

    MS-SSIM of the page without its light as it lies in its picture / laid on the original, with its light / without.
    """
    yield ROW.format("warp", "words", *COLUMNS, "MS-SSIM")
    warps = dict.fromkeys(result.warp for result in results)
    for name, group in [(warp, [r for r in results if r.warp == warp]) for warp in warps] + [("all", list(results))]:
        words, characters = (_points(group, kind) for kind in ("words", "characters"))
        cells = [f"{w:.1f} / {c:.1f}" for w, c in zip(words, characters, strict=True)]
        ms_ssim = " / ".join(f"{value:.3f}" for value in np.mean([r.ms_ssim for r in group], axis=0))
        yield ROW.format(name, sum(r.printed for r in group), *cells, ms_ssim)


def failed_criteria(results: Sequence[Result]) -> Iterator[str]:
    """Criteria that are not met, a line each."""
    for warp in dict.fromkeys(result.warp for result in results):
        group = [r for r in results if r.warp == warp]
        for kind, max_deficit in (("words", MAX_DEFICIT_WORDS), ("characters", MAX_DEFICIT_CHARACTERS)):
            _, _, removed, flat = _points(group, kind)
            if flat - removed > max_deficit:
                yield f"{warp}: {kind} {flat - removed:.1f} points below the flat original (allowed {max_deficit})"
        ms_ssim = float(np.mean([r.ms_ssim[0] for r in group]))
        if ms_ssim < MIN_MS_SSIM:
            yield f"{warp}: MS-SSIM {ms_ssim:.3f} (wanted {MIN_MS_SSIM})"
    for kind, wanted in (("words", MIN_GAIN_WORDS), ("characters", MIN_GAIN_CHARACTERS)):
        raw, _, removed, _ = _points(results, kind)
        if removed - raw < wanted:
            yield f"all: {kind} gain {removed - raw:.1f} points over the raw picture (wanted {wanted})"


def _points(results: Iterable[Result], kind: str) -> list[float]:
    """Mean precision over pages, in per cent, of each of COLUMNS."""
    readings = [[reading.precision for reading in getattr(result, kind)] for result in results]
    return [float(points) for points in 100 * np.mean(readings, axis=0)]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table and what falls short; one line when Tesseract is not there."""
    parser = argparse.ArgumentParser(description="words read on simulated pages")
    parser.add_argument("--pages", type=int, default=52, help="so many pages, spread over the warps")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    try:
        find_tesseract()
    except ProgramMissing as missing:
        print(f"words: {missing}: {missing.hint}")
        return
    start = time.perf_counter()
    results = []
    for result in measured(evenly_chosen(tasks(), options.pages), options.workers):
        results.append(result)
        points = (f"{100 * reading.precision:.1f}" for reading in result.words)
        print(f"{len(results):>3} {result.warp:<14} words", *points, f"MS-SSIM {result.ms_ssim[0]:.3f}", flush=True)
    print(
        f"\nwords / characters read right, per cent, {TYPE_PT:g} pt at {len(results)} pages", *table(results), sep="\n"
    )
    print(*(list(failed_criteria(results)) or ["nothing falls short"]), sep="\n")
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()

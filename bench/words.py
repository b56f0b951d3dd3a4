"""Words read on 52 simulated pages: raw picture, restored page, restored page without its light, flat original.

    python -m bench.words [--seed N] [--pages 14] [--only WARP]... [--workers 2]

The paper's Table 1, over its mix of warps, with about its 12,000 words; the shape, the lamp, the pose and the sentences
of every page are drawn afresh at every run. Every page is 230 × 160 mm of running text before the MIDDLE lens at 0.9 m,
53 pixels to the inch, in light that casts shadows. The flat original is the ceiling: the same print laid flat in even
light, seen by the same camera. All four are read alike, by Tesseract, as `planish ocr` reads a page. Precision as in
`station.words.ocr_precision`.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from bench.light_draws import LAMPS, SPOT, sparing_highlights
from drivers.simulated import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Pose, Text, Truth, Wave, shoot
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.light import Light
from drivers.simulated.scene.scene import place_sheet
from drivers.simulated.scene.sheets import Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.geometry.triangulation import project
from oracles.similarity import align_page, lay_on, page_similarity
from restore import RangeScan, Settings, restore
from restore.scan import Bytes
from restore.texture.page import MM_PER_INCH, sample
from station.words.ocr_precision import MatchCount, count_matching_characters, count_matching_words
from station.words.words import ProgramMissing, find_tesseract, recognise

LENS, DISTANCE_MM = "MIDDLE", 900.0  # as in the paper's experiments
PAGE_MM = (230.0, 160.0)
DPI = 150.0
TILTS_DEG = (5.0, 12.0)  # books lie on a stand: it is from there that their lines look curved
TYPE_PT, TITLE_PT, MARGIN_MM = 14.0, 24.0, 13.0
OPTICS = {"lens": LENS, "distance_mm": DISTANCE_MM, "page_mm": PAGE_MM}

Draw = Callable[[np.random.Generator], Sheet]


def _multi_fold(rng: np.random.Generator) -> Sheet:
    fold, lean = rng.uniform(33, 41), rng.uniform(-9, 9)
    middle = (rng.uniform(-10, 0), -0.7 * lean, -fold - 8)
    return MultiFold(creases=((rng.uniform(-66, -58), lean, fold), middle, (rng.uniform(54, 62), lean, fold - 4)))


# 52 pages: how many of each kind of sheet, and how one is drawn.
WARPS: dict[str, tuple[int, Draw]] = {
    "rolling curl": (9, lambda rng: Curl(radius_mm=rng.uniform(125, 165), angle_deg=rng.uniform(-20, 20))),
    "binding curl": (9, lambda rng: Binding(slope_deg=rng.uniform(50, 59), reach_mm=rng.uniform(33, 52))),
    "multi-fold": (9, _multi_fold),
    "rumples": (
        7,
        lambda rng: Wave(
            slope_deg=rng.uniform(23, 28), wavelength_mm=rng.uniform(105, 155), angle_deg=rng.uniform(-60, 60)
        ),
    ),
    "cone": (
        6,
        lambda rng: Cone(
            apex_mm=rng.uniform(245, 275), opening_deg=rng.uniform(33, 39), angle_deg=rng.uniform(-30, 30)
        ),
    ),
    "Miura fold": (6, lambda rng: Miura(fold_deg=rng.uniform(25, 30), acute_deg=rng.uniform(69, 75))),
    "crumpled": (6, lambda rng: Crumpled(seed=int(rng.integers(1 << 16)), tilt_deg=rng.uniform(7, 9))),
}
COLUMNS = ("raw", "restored", "light removed", "flat")
MAX_DEFICIT_WORDS, MAX_DEFICIT_CHARACTERS = 2.0, 1.0  # points below the flat original
MIN_GAIN_WORDS, MIN_GAIN_CHARACTERS = 18.8, 16.5  # points over the raw picture, on average: the paper's gains
MIN_MS_SSIM = 0.95  # MS-SSIM; flattened photographs reach 0.60 to 0.82


@dataclass(frozen=True)
class Task:
    """One page of the bench."""

    warp: str
    lamp: str
    sheet: Sheet
    light: Light
    tilt_deg: float
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


def tasks(seed: int) -> list[Task]:
    """All pages of a seed, every one with a shape, a lamp and sentences of its own."""
    lamps = [name for name in LAMPS if name != SPOT]
    drawn = []
    for k, (warp, (count, draw)) in enumerate(WARPS.items()):
        for i in range(count):
            rng = np.random.default_rng([seed, k, i])
            lamp = lamps[(seed + len(drawn)) % len(lamps)]
            drawn.append(_task(warp, lamp, draw(rng), rng))
    return drawn


def _task(warp: str, lamp: str, sheet: Sheet, rng: np.random.Generator) -> Task:
    light, _ = LAMPS[lamp](rng)
    return Task(warp, lamp, sheet, light, float(rng.uniform(*TILTS_DEG)), int(rng.integers(1 << 16)))


def evenly_chosen(pages: Sequence[Task], count: int) -> list[Task]:
    """`count` of the pages, evenly spaced over the warps."""
    return [pages[i] for i in np.unique(np.linspace(0, len(pages) - 1, count).round().astype(int))]


def print_of(task: Task) -> Text:
    """What is printed on the page."""
    return Text(title_pt=TITLE_PT, sizes_pt=(TYPE_PT,), margin_mm=MARGIN_MM, seed=task.seed)


def pictures(task: Task) -> Pictures:
    """Shoot, restore, and shoot the flat original."""
    print_, pose = print_of(task), Pose(tilt_deg=task.tilt_deg)
    depth_mm = DISTANCE_MM + LENSES[LENS].pupil_mm
    scene = place_sheet(task.sheet, printed(print_, PAGE_MM), depth_mm=depth_mm, pose=pose)
    light = sparing_highlights(task.light, scene)
    scan, truth = shoot(task.sheet, print_, seed=task.seed, pose=pose, light=light, **OPTICS)
    flat, flat_truth = shoot(Flat(), print_, seed=task.seed, **OPTICS)
    page = restore(scan, Settings(dpi=DPI, shading="remove"))
    images = (cropped(scan, truth), page.master, page.image, sampled_flat(flat, flat_truth))
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


def sampled_flat(scan: RangeScan, truth: Truth) -> Bytes:
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
    motion = align_page(seen.images["light removed"], flat)
    kept, removed = (lay_on(seen.images[name], motion, flat) for name in ("restored", "light removed"))
    ms_ssim = tuple(page_similarity(page, flat) for page in (seen.images["light removed"], kept, removed))
    return Result(task.warp, words, characters, ms_ssim, len(seen.text.split()))


def measured(pages: Sequence[Task], workers: int) -> Iterator[tuple[Task, Result]]:
    """The pages and their results in order, by several processes."""
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=_limit_to_one_thread) as pool:
        yield from zip(pages, pool.map(measure, pages), strict=True)


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
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--pages", type=int, default=52, help="so many pages, spread over the warps")
    parser.add_argument("--only", action="append", choices=WARPS, help="a warp: the same pages as in a run of all")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args(arguments)
    try:
        find_tesseract()
    except ProgramMissing as missing:
        print(f"words: {missing}: {missing.hint}")
        return
    start = time.perf_counter()
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}", flush=True)
    results = []
    chosen = [page for page in evenly_chosen(tasks(seed), options.pages) if page.warp in (options.only or WARPS)]
    for task, result in measured(chosen, options.workers):
        results.append(result)
        points = (f"{100 * reading.precision:.1f}" for reading in result.words)
        print(
            f"{len(results):>3} {result.warp:<14} {task.lamp:<12} words",
            *points,
            f"MS-SSIM {result.ms_ssim[0]:.3f}",
            flush=True,
        )
    print(
        f"\nwords / characters read right, per cent, {TYPE_PT:g} pt at {len(results)} pages, seed {seed}",
        *table(results),
        sep="\n",
    )
    print(*(list(failed_criteria(results)) or ["nothing falls short"]), sep="\n")
    print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()

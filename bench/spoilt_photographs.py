"""`python -m bench.spoilt_photographs [--seed S] [--sets 50] [--width 1200] [--only KIND …]`: sets that went wrong.

Each set of five photographs of a fresh page is spoilt in one way, as operators spoil them, and given to the steps of
`planish photos`. It is to be refused, or the page is to be right; a page that is wrong and of which no warning says so
is SILENT, and the command ends with exit code 1. Right is a page whose pixels lie within RIGHT_MM rms of their exact
places, metric unless a warning says that the size is a guess, of which no more than FOREIGN shows anything else than
the page, and that shows all of its print but LOST_MM at its sides. That a photograph is left out is no such warning.
Sheets, poses, print, light and spoils are drawn from the seed, by default of today.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.draws import seed_of_today
from bench.spoils import KINDS, MARGIN_MM, PAGE_MM, Views, given, good_set, truth
from drivers.simulated import Cone, Curl, Wave
from drivers.simulated.scene.sheets import Sheet
from oracles.markers import rigid_residual
from restore import RestoredPage, RestoreError, Settings, reconstruct_page, restore
from restore.photogrammetry import SCALE_CARD
from restore.scan import Floats
from restore.texture.page import MM_PER_INCH

GOOD = "unspoilt"
RIGHT_MM = 0.25  # one pixel of the photographs at the default width
FOREIGN = 0.005  # of the page: 0.9 cm² of A6 and a half
LOST_MM = 1.0
NONE = 255  # source of what is not on the page
SETTINGS = Settings(points=300, dpi=100)
SHOWN = 150  # characters of what is said
SHEETS: tuple[Callable[[np.random.Generator], Sheet], ...] = (
    lambda rng: Wave(slope_deg=rng.uniform(12, 28), wavelength_mm=rng.uniform(90, 160)),
    lambda rng: Curl(radius_mm=rng.uniform(180, 320), taper=rng.uniform(-0.3, 0.3)),
    lambda rng: Cone(apex_mm=rng.uniform(280, 600), opening_deg=rng.uniform(25, 40)),
)


@dataclass(frozen=True)
class Result:
    """What came of a set: refused, right, warned (wrong, and a warning says so) or SILENT, and what was said."""

    verdict: str
    said: str
    rms_mm: float = np.nan
    foreign: float = np.nan


def main(seed: int | None, sets: int, width: int, only: Sequence[str]) -> int:
    """Print a line for each set and the totals; returns the number of sets that are wrong in silence."""
    seed = seed or seed_of_today()
    print(f"spoilt sets of five photographs of {width} × {width * 3 // 4}, seed {seed}", flush=True)
    kinds = [GOOD, *KINDS]
    totals: dict[str, int] = {}
    base: Views = []
    drawn = -1
    for number in range(sets):
        round_, kind = number // len(kinds), kinds[number % len(kinds)]
        if only and kind not in only:
            continue
        if round_ != drawn:
            rng = np.random.default_rng([seed, round_])
            base, drawn = good_set(SHEETS[round_ % len(SHEETS)](rng), int(rng.integers(1 << 30)), _size(width)), round_
        rng = np.random.default_rng([seed, round_, kinds.index(kind)])
        start = time.process_time()
        views = base if kind == GOOD else KINDS[kind](base, rng)
        spoilt = time.process_time()
        result = compared(views)
        totals[result.verdict] = totals.get(result.verdict, 0) + 1
        seconds = f"{spoilt - start:3.0f} + {time.process_time() - spoilt:3.0f} s"
        figures = f"{result.rms_mm:7.3f} mm {result.foreign:6.2%}" if np.isfinite(result.rms_mm) else " " * 17
        print(f"{number:>3} {kind:<16}{result.verdict:<9}{figures}  {seconds}  {result.said[:SHOWN]}", flush=True)
    print(", ".join(f"{count} {verdict}" for verdict, count in sorted(totals.items())))
    return totals.get("SILENT", 0)


def _size(width: int) -> tuple[int, int]:
    return width, width * 3 // 4


def compared(views: Views) -> Result:
    """What comes of a set of photographs."""
    try:
        page = reconstruct_page(given(views), card=SCALE_CARD)
        restored = restore(page.mesh, SETTINGS, photos=page.photographs)
    except RestoreError as error:
        return Result("refused", str(error))
    names = [view.given.name for view in views]
    places, true, known = _compared(restored, views, [names.index(one.name) for one in page.photographs])
    said = "; ".join(one.text for one in page.findings)
    doubted = any(one.code != "view_apart" for one in page.findings)
    foreign = 1 - known / max(len(places), 1)
    shown = np.isfinite(true).all(axis=1)
    if shown.sum() < 3:
        return Result("warned" if doubted else "SILENT", said, np.inf, foreign)
    error, scale = rigid_residual(places[shown], true[shown])
    if page.report["scale_source"]["from"] == "none":
        error, _ = rigid_residual(places[shown] * scale, true[shown])
    rms = float(np.sqrt((error**2).sum(axis=1).mean()))
    if rms <= RIGHT_MM and foreign <= FOREIGN and _whole(true[shown]):
        return Result("right", said, rms, foreign)
    return Result("warned" if doubted else "SILENT", said, rms, foreign)


def _whole(true: Floats) -> bool:
    """Whether places (n, 2) mm that a page shows reach round its print."""
    low, high = np.quantile(true, 0.001, axis=0), np.quantile(true, 0.999, axis=0)
    return bool((low < MARGIN_MM + LOST_MM).all() and (high > np.array(PAGE_MM) - MARGIN_MM - LOST_MM).all())


def _compared(page: RestoredPage, views: Views, numbers: Sequence[int]) -> tuple[Floats, Floats, int]:
    """Places (n, 2) mm of pixels of the page, the true ones (n, 2) of what they show, and how many show the page.

    numbers: of the views that the sources of the page stand for. The rim of the page, two pixels wide, counts as page.
    """
    assert page.page_source is not None
    inner = page.page_source != NONE
    inner[2:-2, 2:-2] &= inner[4:, 2:-2] & inner[:-4, 2:-2] & inner[2:-2, 4:] & inner[2:-2, :-4]
    rows, cols = np.nonzero(inner & (page.page_source > 0))
    true = np.full((len(rows), 2), np.nan)
    for index, number in enumerate(numbers, 1):
        here = page.page_source[rows, cols] == index
        if here.any():
            true[here] = truth(views[number], page.page_map[rows[here], cols[here]].astype(float))
    places = np.stack([cols, -rows], axis=1) * MM_PER_INCH / page.dpi
    return places, true, int(np.isfinite(true).all(axis=1).sum())


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--sets", type=int, default=50)
    parser.add_argument("--width", type=int, default=1200)
    parser.add_argument("--only", nargs="+", choices=(GOOD, *KINDS), default=[])
    options = parser.parse_args()
    sys.exit(1 if main(options.seed, options.sets, options.width, options.only) else 0)

"""`python -m bench.layout [--count 3] [--seed S] [--mode fine|fast]`: the layout of whole pages, pixel by pixel.

Every pixel of the page has a place in the scanner's picture, and what lies on that line of sight has an exact place on
the sheet before it was warped. The difference of the two, after the best rigid motion and without scale, is the error
of the layout; no marker and no print has a part in it. Sheets are drawn from the seed, by default of today, through the
whole pipeline with noise, shadow and drop-outs. `--artwork` takes another print than the markers, `--table` another
table than the dark one.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable
from functools import partial
from typing import get_args

import numpy as np

from bench.draws import draws_parser, seed_of_today
from drivers.simulated import Cone, Crumpled, Curl, Miura, MultiFold, Pose, Spread, Truth, Wave, shoot
from drivers.simulated.scene.artwork import ARTWORK
from drivers.simulated.scene.scene import Table
from drivers.simulated.scene.sheets import Sheet
from oracles.layout import layout_error
from restore import RangeScan, Settings, restore

Shot = Callable[..., tuple[RangeScan, Truth]]

COUNT = 3
PAGE_WIDTH_MM = 280.0
TILT_DEG = 5.0  # at most, as pages lie
ROW = "{:<12} {:>10} {:>10} {:>10} {:>10} {:>10} {:>7}"
HEADINGS = ("sheet", "wanted mm", "median mm", "worst mm", "p99 mm", "page size", "warned")

# sheet → most rms mm that is wanted, and how one is drawn.
SHEETS: dict[str, tuple[float, Callable[[np.random.Generator], Sheet]]] = {
    "roll": (0.015, lambda rng: _roll(rng, 30, 60)),
    "cone": (0.015, lambda rng: Cone(apex_mm=rng.uniform(280, 600), opening_deg=rng.uniform(25, 45))),
    "wave": (0.015, lambda rng: Wave(slope_deg=rng.uniform(15, 38), wavelength_mm=rng.uniform(90, 200))),
    "brochure": (0.035, lambda rng: MultiFold(creases=_creases(rng))),
    "Miura": (0.035, lambda rng: Miura(fold_deg=rng.uniform(15, 35), side_mm=rng.uniform(42, 70))),
    "deep gutter": (0.04, lambda rng: Spread(slope_deg=rng.uniform(58, 68), reach_mm=rng.uniform(20, 35))),
    "crumpled": (0.08, lambda rng: Crumpled(tilt_deg=rng.uniform(6, 12), seed=int(rng.integers(1000)))),
    # nothing is wanted of it: a sample at its sides is two to four millimetres of paper
    "steep roll": (np.nan, lambda rng: _roll(rng, 60, 80)),
}


def _roll(rng: np.random.Generator, least_deg: float, most_deg: float) -> Curl:
    """A roll whose steeper side ends at a slope between two."""
    taper, slope = rng.uniform(-0.3, 0.3), np.radians(rng.uniform(least_deg, most_deg))
    return Curl(radius_mm=PAGE_WIDTH_MM / 2 * (1 + abs(taper) / 2) / slope, taper=taper)


def _creases(rng: np.random.Generator) -> tuple[tuple[float, float, float], ...]:
    """Three creases across the page: where, how they lean, and how far they are folded, to and fro."""
    return tuple(
        (place + float(rng.uniform(-8, 8)), float(rng.uniform(-7, 7)), side * float(rng.uniform(25, 50)))
        for place, side in ((-72.0, 1.0), (0.0, -1.0), (72.0, 1.0))
    )


def main(
    count: int = COUNT, seed: int | None = None, mode: str = "fine", artwork: str = "markers", table: Table = "dark"
) -> None:
    """Print a line for each kind of sheet."""
    seed = seed or seed_of_today()
    print(f"\nlayout of whole pages, {count} sheets of each kind, seed {seed}, mode {mode}; rms mm over all pixels")
    print(f"print: {artwork}, table: {table}")
    shot = partial(shoot, artwork=ARTWORK[artwork](), mode=mode, table=table)
    print(ROW.format(*HEADINGS))
    for number, (kind, (wanted, draw)) in enumerate(SHEETS.items()):
        drawn = [np.random.default_rng([seed, number, k]) for k in range(count)]
        print(_line(kind, wanted, [measured(draw(rng), rng, shot) for rng in drawn]), flush=True)


def measured(sheet: Sheet, rng: np.random.Generator, shot: Shot) -> tuple[float, float, float, bool]:
    """rms and 99th percentile of the error, mm, the greater relative error of the sides, and whether the page warns."""
    pose = Pose(tilt_deg=rng.uniform(-TILT_DEG, TILT_DEG), turn_deg=rng.uniform(-TILT_DEG, TILT_DEG))
    scan, truth = shot(sheet, seed=int(rng.integers(2**31)), pose=pose)
    page = restore(scan, Settings())
    error = np.linalg.norm(layout_error(page, scan, truth), axis=1)
    sizes = [abs(found / true - 1) for found, true in zip(page.report["page_mm"], truth.page_mm, strict=True)]
    return float(np.sqrt((error**2).mean())), float(np.quantile(error, 0.99)), max(sizes), bool(page.findings)


def _line(kind: str, wanted: float, found: list[tuple[float, float, float, bool]]) -> str:
    rms, high, sizes, warned = zip(*found, strict=True)
    figures = (
        "–" if np.isnan(wanted) else f"{wanted:.3f}",
        f"{statistics.median(rms):.4f}",
        f"{max(rms):.4f}",
        f"{max(high):.3f}",
        f"{max(sizes):.3%}",
        sum(warned),
    )
    return ROW.format(kind, *figures)


if __name__ == "__main__":
    parser = draws_parser(__doc__, COUNT)
    parser.add_argument("--mode", choices=("fine", "fast"), default="fine")
    parser.add_argument("--artwork", choices=ARTWORK, default="markers")
    parser.add_argument("--table", choices=get_args(Table), default="dark")
    options = parser.parse_args()
    main(options.count, options.seed, options.mode, options.artwork, options.table)

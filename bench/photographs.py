"""`python -m bench.photographs [--seed S] [--width 2000] [--views 10 5 …] [--sheets wave …]`: pages without a scanner.

Plain printed pages are photographed by hand in the simulated world, reconstructed and restored from the photographs
alone. Every pixel of the page was painted from a pixel of a photograph, and what that pixel shows has an exact place on
the flat page. The difference of the two, after the best rigid motion and without scale, is the error: over the whole
page, over the print, which leaves the blank margins out, and over the left and the right half by themselves, the pages
of a spread. Sheets, poses, light and print are drawn from the seed, by default of today. Fewer views are the first so
many of the same set.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bench.draws import seed_of_today
from drivers.simulated import Cone, Crumpled, Curl, Miura, MultiFold, Spread, Text, Wave
from drivers.simulated.scene.sheets import Sheet
from oracles.markers import rigid_residual
from oracles.simulation.photographs import PhotographSet, Shots, photograph_page, views_from
from restore import Photograph, RestoredPage, RestoreError, Settings, reconstruct_page, restore
from restore.photogrammetry import SCALE_CARD
from restore.scan import Floats
from restore.texture.page import MM_PER_INCH

CARD_DPI = 355.6  # fourteen pixels to a millimetre
MARGIN_MM = 15.0  # of the printed page
MAX_PIXELS = 60_000  # of a page are compared
NONE = 255  # source of what is not on the page
ROW = "{:<9} {:>5} {:>9} {:>8} {:>8} {:>9} {:>12} {:>9} {:>8} {:>7} {:>6}"
HEADINGS = ("sheet", "views", "wanted", "rms", "99 %", "of print", "of halves", "scale", "size", "joined", "cpu s")
SMOOTH = {10: "0.10", 5: "0.12"}


@dataclass(frozen=True)
class Kind:
    """A kind of sheet: how one is drawn, and the error wanted, mm rms, by the number of views."""

    draw: Callable[[np.random.Generator], Sheet]
    wanted: Mapping[int, str]


SHEETS = {
    "wave": Kind(lambda rng: Wave(slope_deg=rng.uniform(15, 38), wavelength_mm=rng.uniform(90, 200)), SMOOTH),
    "curl": Kind(lambda rng: Curl(radius_mm=rng.uniform(180, 320), taper=rng.uniform(-0.3, 0.3)), SMOOTH),
    "cone": Kind(lambda rng: Cone(apex_mm=rng.uniform(280, 600), opening_deg=rng.uniform(25, 45)), SMOOTH),
    "roll": Kind(lambda rng: Curl(radius_mm=rng.uniform(110, 160), taper=rng.uniform(-0.3, 0.3)), SMOOTH),
    # of the whole spread, and of each page by itself
    "gutter": Kind(lambda rng: Spread(slope_deg=rng.uniform(50, 66), reach_mm=rng.uniform(22, 35)), {10: "0.25/0.12"}),
    "miura": Kind(lambda rng: _miura(rng), {12: "0.25"}),
    "multifold": Kind(lambda rng: _multifold(rng), {12: "0.25"}),
    "crumpled": Kind(lambda rng: Crumpled(seed=int(rng.integers(2**16))), {20: "0.6"}),
}


def _miura(rng: np.random.Generator) -> Miura:
    side, width = rng.uniform(40, 60, 2)
    return Miura(side_mm=side, width_mm=width, acute_deg=rng.uniform(62, 80), fold_deg=rng.uniform(20, 35))


def _multifold(rng: np.random.Generator) -> MultiFold:
    """Three creases a quarter of the page apart, mountain and valley in turn."""
    turns = rng.uniform(25, 50, 3) * rng.choice([-1, 1]) * [1, -1, 1]
    places = rng.uniform(-10, 10, 3) + [-70, 0, 70]
    return MultiFold(creases=tuple(zip(places, rng.uniform(-8, 8, 3), turns, strict=True)))


def main(seed: int | None = None, width: int = 2000, views: tuple[int, ...] = (), sheets: tuple[str, ...] = ()) -> None:
    """Print a line for each kind of sheet and number of views."""
    seed = seed or seed_of_today()
    shots = Shots(size=(width, width * 3 // 4))
    print(f"\npages from photographs of {shots.size[0]} × {shots.size[1]}, seed {seed}; mm, rigid fit, no scale fit")
    print(ROW.format(*HEADINGS), flush=True)
    for number, (name, kind) in enumerate(SHEETS.items()):
        if sheets and name not in sheets:
            continue
        rng = np.random.default_rng([seed, number])
        counts = views or tuple(kind.wanted)
        taken = photographed(kind.draw(rng), int(rng.integers(2**31)), max(counts), shots)
        for count in counts:
            cells = measured(views_from(taken, range(count)))
            print(ROW.format(name, count, kind.wanted.get(count, ""), *cells), flush=True)


def photographed(sheet: Sheet, seed: int, views: int, shots: Shots) -> PhotographSet:
    """A set of photographs of a page of 10-point text."""
    artwork = Text(sizes_pt=(10.0,), title_pt=18.0, columns=2, margin_mm=MARGIN_MM, seed=seed)
    card = SCALE_CARD.picture(CARD_DPI)
    return photograph_page(sheet, artwork, views=views, seed=seed, card=card, card_dpi=CARD_DPI, shots=shots)


def measured(taken: PhotographSet) -> tuple[str, ...]:
    """The cells of a line: errors, scale, error of the page's size, photographs that joined, processor time."""
    start = time.process_time()
    focal = Shots(size=taken.cameras[0].size).focal_px  # as EXIF tells it: whole millimetres, without jitter
    photographs = [Photograph(image, str(number), focal) for number, image in enumerate(taken.images)]
    try:
        page = reconstruct_page(photographs)
        restored = restore(page.mesh, Settings(), photos=page.photographs)
    except RestoreError as error:
        return ("–",) * 6 + (str(error)[:60], "")
    seconds = time.process_time() - start
    places, true = compared(restored, [int(one.name) for one in page.photographs], taken)
    error, _ = rigid_residual(places, true)
    size = np.array(taken.scene.printed.page_mm)
    printed = ((true > MARGIN_MM) & (true < size - MARGIN_MM)).all(axis=1)
    of_print, scale = rigid_residual(places[printed], true[printed])
    left = true[:, 0] < size[0] / 2
    halves = (f"{_rms(rigid_residual(places[half], true[half])[0]):.3f}" for half in (left, ~left))
    off = np.linalg.norm(error, axis=1)
    wrong = max(abs(found - side) for found, side in zip(restored.report["page_mm"], size, strict=True))
    return (
        f"{_rms(error):.3f}",
        f"{np.quantile(off, 0.99):.3f}",
        f"{_rms(of_print):.3f}",
        " ".join(halves),
        f"{scale - 1:+.3%}",
        f"{wrong:.2f}",
        f"{len(page.photographs)}/{len(photographs)}",
        f"{seconds:.0f}",
    )


def _rms(errors: Floats) -> float:
    return float(np.sqrt((errors**2).sum(axis=1).mean()))


def compared(page: RestoredPage, numbers: list[int], taken: PhotographSet) -> tuple[Floats, Floats]:
    """Places (n, 2) mm of pixels of the restored page, and the true ones (n, 2) of what they show."""
    assert page.page_source is not None
    rows, cols = np.nonzero((page.page_source != NONE) & (page.page_source > 0))
    step = len(rows) // MAX_PIXELS + 1
    rows, cols = rows[::step], cols[::step]
    true = np.full((len(rows), 2), np.nan)
    for index, number in enumerate(numbers, 1):
        here = page.page_source[rows, cols] == index
        if here.any():
            true[here], _ = taken.truth_at(number, page.page_map[rows[here], cols[here]].astype(float))
    known = np.isfinite(true).all(axis=1)
    return np.stack([cols, -rows], axis=1)[known] * MM_PER_INCH / page.dpi, true[known]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=2000)
    parser.add_argument("--views", type=int, nargs="+", default=[])
    parser.add_argument("--sheets", nargs="+", choices=tuple(SHEETS), default=[])
    options = parser.parse_args()
    main(options.seed, options.width, tuple(options.views), tuple(options.sheets))

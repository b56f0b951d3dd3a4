"""`python -m bench.photographed_blanks [--seed S] [--width 2000] [--views 10] [--blanks 60 100]`: pages with nothing on
a part of them.

Where a page is blank there is no print to measure, and its surface is interpolated. Pages of text with a blank square,
in mm, are photographed in the simulated world as those of `bench.photographs` are, and restored. What each pixel of the
restored page shows has an exact place on the flat page, blank or not: the error is that within the square, when the
whole page is laid on the exact one by the best rigid motion, without scale. Interpolated is the share of the square
that the coverage map marks as filled in.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bench.draws import seed_of_today
from bench.photographs import CARD_DPI, compared
from drivers.simulated import Cone, Curl, Text, Wave
from drivers.simulated.scene.artwork import Artwork, Print
from drivers.simulated.scene.artwork.printed import PAPER
from drivers.simulated.scene.sheets import PageSize, Sheet
from oracles.markers import rigid_residual
from oracles.simulation.photographs import PhotographSet, Shots, photograph_page
from restore import Photograph, RestoreError, Settings, reconstruct_page, restore
from restore.photogrammetry import SCALE_CARD
from restore.texture.coverage import CoverageClass
from restore.texture.page import MM_PER_INCH

ROW = "{:<6} {:>6} {:>7} {:>8} {:>8} {:>8} {:>13}"
HEADINGS = ("sheet", "blank", "wanted", "rms", "99 %", "page", "interpolated")
WANTED = {60: "0.15", 100: "0.4"}
SHEETS: dict[str, Callable[[np.random.Generator], Sheet]] = {
    "wave": lambda rng: Wave(slope_deg=rng.uniform(15, 38), wavelength_mm=rng.uniform(90, 200)),
    "curl": lambda rng: Curl(radius_mm=rng.uniform(180, 320), taper=rng.uniform(-0.3, 0.3)),
    "cone": lambda rng: Cone(apex_mm=rng.uniform(280, 600), opening_deg=rng.uniform(25, 45)),
}


@dataclass(frozen=True)
class WithBlank:
    """Another artwork with a blank square of a side, mm, about the middle of the page, shifted by some mm."""

    name: ClassVar[str] = "with-blank"
    artwork: Artwork
    side: float
    shift: tuple[float, float]

    def square(self, page_mm: PageSize) -> tuple[np.ndarray, np.ndarray]:
        """Lower left and upper right corner (2,) mm from the lower left corner of the page."""
        middle = np.array(page_mm) / 2 + self.shift
        return middle - self.side / 2, middle + self.side / 2

    def print_on(self, page_mm: PageSize) -> Print:
        """The page, printed but for the square."""
        printed = self.artwork.print_on(page_mm)
        low, high = (corner * printed.dpi / MM_PER_INCH for corner in self.square(page_mm))
        image = printed.image.copy()
        rows = len(image) - np.rint([high[1], low[1]]).astype(int)
        cols = np.rint([low[0], high[0]]).astype(int)
        image[rows[0] : rows[1], cols[0] : cols[1]] = PAPER
        return replace(printed, image=image)


def main(seed: int | None, width: int, views: int, blanks: tuple[int, ...], sheets: tuple[str, ...]) -> None:
    """Print a line for each sheet and side of a square."""
    seed = seed or seed_of_today()
    shots = Shots(size=(width, width * 3 // 4))
    print(f"blank squares in {views} photographs of {width} × {width * 3 // 4}, seed {seed}; mm, no scale fit")
    print(ROW.format(*HEADINGS), flush=True)
    for number, (name, draw) in enumerate(SHEETS.items()):
        for side in blanks:
            if sheets and name not in sheets:
                continue
            rng = np.random.default_rng([seed, number, side])
            sheet, text = draw(rng), Text(sizes_pt=(10.0,), title_pt=18.0, columns=2, margin_mm=15.0, seed=seed)
            artwork = WithBlank(text, side, (float(rng.uniform(-50, 50)), float(rng.uniform(-15, 15))))
            card = {"card": SCALE_CARD.picture(CARD_DPI), "card_dpi": CARD_DPI}
            taken = photograph_page(sheet, artwork, views=views, seed=seed, shots=shots, **card)
            print(ROW.format(name, side, WANTED.get(side, ""), *_measured(taken, artwork)), flush=True)


def _measured(taken: PhotographSet, artwork: WithBlank) -> tuple[str, ...]:
    """The cells of a line: errors within the square, that of the page, and how much of the square is interpolated."""
    focal = Shots(size=taken.cameras[0].size).focal_px
    photographs = [Photograph(image, str(number), focal) for number, image in enumerate(taken.images)]
    try:
        page = reconstruct_page(photographs)
        restored = restore(page.mesh, Settings(), photos=page.photographs)
    except RestoreError as error:
        return ("–", "–", "–", str(error)[:60])
    places, true = compared(restored, [int(one.name) for one in page.photographs], taken)
    error, _ = rigid_residual(places, true)
    low, high = artwork.square(taken.scene.printed.page_mm)
    inside = ((true > low) & (true < high)).all(axis=1)
    off = np.linalg.norm(error, axis=1)
    cols, rows = np.rint(places[inside] * [1, -1] * restored.dpi / MM_PER_INCH).astype(int).T
    kinds = restored.coverage[rows, cols]
    return (
        f"{np.sqrt((off[inside] ** 2).mean()):.3f}",
        f"{np.quantile(off[inside], 0.99):.3f}",
        f"{np.sqrt((off**2).mean()):.3f}",
        f"{(kinds == CoverageClass.INTERPOLATED).mean():.0%}",
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int)
    parser.add_argument("--width", type=int, default=2000)
    parser.add_argument("--views", type=int, default=10)
    parser.add_argument("--blanks", type=int, nargs="+", default=list(WANTED))
    parser.add_argument("--sheets", nargs="+", choices=tuple(SHEETS), default=[])
    options = parser.parse_args()
    main(options.seed, options.width, options.views, tuple(options.blanks), tuple(options.sheets))

"""Accuracy of shading removal: colour differences to the same page in even light, before and after.

    python -m bench.shading [--seed N] [--sheet KIND]...

Sheets, sentences and lamps are drawn afresh at every run.

The truth is the flat print seen by the same camera through the same lens at the same resolution, lit everywhere as
paper is that faces the scanner in the middle of the picture, and carried to the page through the same map. What is
left of a difference is the light's, not the geometry's.
How bright an even page is, is a matter of exposure: the truth is exposed like each page that it is compared with, and
its relative error is reported as the level. `noise` is the difference that sensor noise alone makes, in even light:
no method can be better.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from bench.light_draws import LAMPS, SHEETS, SPOT, sparing_highlights
from bench.timing import REPEATS, median_seconds
from drivers.simulated import Figure, Text
from drivers.simulated.imaging.colour import NOISE_CODES, photograph
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.albedo import LINEAR, srgb
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.light import Lamp, Light
from drivers.simulated.scene.scene import place_sheet
from drivers.simulated.scene.sheets import Binding, Sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from restore.prepared.prepare import prepare
from restore.prepared.prepared import Prepared, Unrolled
from restore.scan import Bytes, Floats, Mask
from restore.settings import Settings
from restore.shading.relief import relief_of
from restore.shading.remove import LIGHT_DPI, PageLight, find_light
from restore.texture.page import MM_PER_INCH, paint_page

SEED = 5
PAGE_MM = (280.0, 200.0)
DISTANCE_MM = 900.0
DPI = 150.0
A4_MM, A4_DPI = (297.0, 210.0), 300.0  # the page that is timed
PAPER_CODES = 4  # of 255: bare paper in the truth differs from the paper's own colour by less, farther off it is ink
INK_MM = 1.0  # paper nearer to ink than this is judged with neither: the lens has blurred both

DESK_LAMP = Light((Lamp((-500.0, 450.0, -170.0)),), shadows=True)
LAMPS_A_PAGE = 3


@dataclass(frozen=True, eq=False)
class Case:
    """A page in some light. seen, even: the picture, and the same without noise in even light (480, 640, 3)."""

    surface: Prepared
    unrolled: Unrolled
    seen: Bytes
    even: Bytes
    even_noisy: Bytes

    def page(self, texture: Bytes, dpi: float = DPI) -> tuple[Bytes, Mask]:
        """The page (h, w, 3) painted from a picture of the camera, and where it is."""
        painting = paint_page(replace(self.unrolled.fine, texture=texture), dpi)
        return painting.image, painting.mask

    def find_light(self) -> PageLight:
        """The light of the page as it is seen."""
        relief = relief_of(self.unrolled.fine, self.surface.normals_on, LIGHT_DPI)
        return find_light(*self.page(self.seen, LIGHT_DPI), relief)


def case(sheet: Sheet, artwork: Artwork, light: Light) -> Case:
    """Shoot a page in some light, and lay it flat."""
    surface, unrolled = measured_and_unrolled(sheet, artwork)
    lens = LENSES["MIDDLE"]
    scene = place_sheet(sheet, printed(artwork, PAGE_MM), depth_mm=DISTANCE_MM + lens.pupil_mm)
    scene = replace(scene, light=sparing_highlights(light, scene))
    caster, maps, body = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene), nominal(lens)

    def picture(shaded: bool, noise: float) -> Bytes:
        rng = np.random.default_rng(SEED)
        return photograph(scene, caster, maps, body, rng, shaded=shaded, noise_codes=noise)

    return Case(surface, unrolled, picture(True, NOISE_CODES), picture(False, 0.0), picture(False, NOISE_CODES))


@cache
def measured_and_unrolled(sheet: Sheet, artwork: Artwork) -> tuple[Prepared, Unrolled]:
    """The surface of a page as the scanner measured it, and unrolled: the same in any light."""
    lens = LENSES["MIDDLE"]
    scene = place_sheet(sheet, printed(artwork, PAGE_MM), depth_mm=DISTANCE_MM + lens.pupil_mm)
    scan, _ = shoot_scene(scene, nominal(lens), MODES["fine"], DISTANCE_MM, np.random.default_rng(SEED))
    surface = prepare(scan)
    return surface, surface.unroll(Settings(), lambda _: nullcontext())


def areas(even: Bytes, mask: Mask, dpi: float) -> tuple[Mask, Mask]:
    """Masks (h, w) of bare paper and of print on a page in even light."""
    white = np.median(even[mask & (even.min(axis=2) > np.percentile(even[mask].min(axis=1), 60))], axis=0)
    paper = mask & (np.abs(even - white).max(axis=2) <= PAPER_CODES)
    reach = 2 * round(INK_MM * dpi / MM_PER_INCH) + 1
    return cv2.erode(paper.astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0, mask & ~paper


def difference(one: Bytes, other: Bytes, where: Mask) -> Floats:
    """(n,) ΔE2000 (CIE 142:2001) between two sRGB pictures (h, w, 3) at the pixels of a mask (h, w)."""
    from skimage.color import deltaE_ciede2000, rgb2lab

    return np.asarray(deltaE_ciede2000(*(rgb2lab(picture[where][None] / 255.0)[0] for picture in (one, other))))


def errors_of(lit_case: Case) -> list[float]:
    """Mean ΔE2000 on paper, then on print: with the light, without it, and of noise alone; and how far the level of the
    evened paper is off, as a share."""
    kept, mask = lit_case.page(lit_case.seen)
    even, noisy = lit_case.page(lit_case.even)[0], lit_case.page(lit_case.even_noisy)[0]
    removed = lit_case.find_light().removed_from(kept, mask, DPI).image
    paper, ink = areas(even, mask, DPI)
    levels = [brightness(page, paper) / brightness(even, paper) for page in (kept, removed, noisy)]
    truths = [exposed(even, level) for level in levels]
    pages = list(zip((kept, removed, noisy), truths, strict=True))
    return [float(difference(*pair, where).mean()) for where in (paper, ink) for pair in pages] + [levels[1] - 1]


def brightness(page: Bytes, where: Mask) -> float:
    """Mean light of a page (h, w, 3) at the pixels of a mask (h, w)."""
    return float(LINEAR[page[where]].mean())


def exposed(page: Bytes, level: float) -> Bytes:
    """A page (h, w, 3) in `level` times as much light."""
    codes = srgb(LINEAR * np.float32(level)).round().astype(np.uint8)
    return np.asarray(codes[page])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, then the time of an A4 page."""
    parser = argparse.ArgumentParser(description="colour differences to the same page in even light")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--sheet", action="append", choices=SHEETS, help="a kind of sheet; all of them unless given")
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: mean ΔE2000 to the same page in even light; kept → removed (noise alone)")
    print(ROW.format("sheet", "artwork", "light", "paper", "print", "level"))
    for line in lines(seed, options.sheet or list(SHEETS)):
        print(ROW.format(*line), flush=True)
    seconds = a4_seconds()
    print(
        f"\nlight removed from {A4_MM[0]:g} × {A4_MM[1]:g} mm at {A4_DPI:g} dpi: {seconds:.2f} s (median of {REPEATS})"
    )


ROW = "{:<11} {:<7} {:<12} {:>22} {:>22} {:>7}"


def lines(seed: int, kinds: Sequence[str]) -> Iterator[tuple[str, ...]]:
    """Sheet, artwork, lamp, and the differences on paper and print; all three drawn for every sheet of a kind."""
    lamps = [name for name in LAMPS if name != SPOT]
    for number, name in enumerate(SHEETS):
        if name not in kinds:
            continue
        rng = np.random.default_rng([seed, number])
        sheet = SHEETS[name](rng)
        artworks: dict[str, Artwork] = {"text": Text(seed=int(rng.integers(1 << 16))), "figure": Figure()}
        for k, (kind, artwork) in enumerate(artworks.items()):
            for lamp in range(LAMPS_A_PAGE):
                lit = lamps[(seed + number + k + lamp) % len(lamps)]
                *six, level = errors_of(case(sheet, artwork, LAMPS[lit](rng)[0]))
                cells = [f"{k:5.2f} → {r:5.2f} ({n:.2f})" for k, r, n in (six[:3], six[3:])]
                yield name, kind, lit, *cells, f"{level:+.1%}"


def a4_seconds() -> float:
    """Median seconds of removing the light from an A4 page, its shape known as the range grid knows it."""
    lit_case = case(Binding(), Text(), DESK_LAMP)
    dpi = A4_DPI * float(np.sqrt(np.prod(A4_MM) / np.prod(PAGE_MM)))  # as many pixels as A4 has
    image, mask = lit_case.page(lit_case.seen, dpi)

    def run() -> None:
        lit_case.find_light().removed_from(image, mask, dpi)

    return median_seconds(run)


if __name__ == "__main__":
    main()

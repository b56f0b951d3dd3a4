"""Colours of pages under tinted lamps drawn afresh, by what `--white-balance` makes of them.

    python -m bench.light_white [--seed N] [--sheet KIND]... [--each 7]

Mean ΔE2000 to the same print in even, neutral light, exposed alike: the page as recorded, with its light removed and
the lamp's colour kept, with bare paper made neutral, and converted by the profile of a chart that was shot flat in the
same lamp. Lamps are Planckian radiators, seen by a camera balanced for 6500 K.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from bench.chart_light import chart_image
from bench.light_draws import LAMPS, SHEETS, Spot
from bench.light_families import BORDER_MM, DPI, colour_error
from bench.light_prints import PRINTS
from bench.light_stage import Stage, mean_albedo, picture
from bench.shading import PAGE_MM
from drivers.simulated import Flat
from drivers.simulated.scene.light import Light
from restore.scan import Bytes, Floats
from restore.shading.white import balance_on_paper
from restore.texture.page import MM_PER_INCH
from station.colour.chart import find_chart
from station.colour.fit import fit_colours
from station.images.conversion import image_to_srgb
from station.images.icc import encode_profile

KINDS = ("curl", "wave", "binding", "multi-fold")
FAMILIES = ("colour patches", "magazine", "halftones", "pastels", "greys", "text", "stained")
MIREDS = (150.0, 370.0)  # of the lamps: 6700 K to 2700 K
BALANCED_K = 6500.0
SENSED_NM = np.array([610.0, 540.0, 465.0])  # middles of the camera's channels
SECOND_RADIATION = 1.438777e7  # nm K
COLUMNS = ("recorded", "keep", "paper", "profile")
ROW = "{:<11} {:<15} {:<12} {:>7}" + " {:>10}" * 4


def planckian(kelvin: float) -> Floats:
    """(3,) light of a black body in the channels of a camera balanced for BALANCED_K, green being 1."""
    against = np.expm1(SECOND_RADIATION / SENSED_NM / BALANCED_K) / np.expm1(SECOND_RADIATION / SENSED_NM / kelvin)
    return np.asarray(against / against[1])


def tinted(light: Light, tint: Floats) -> Light:
    """The light with all its colours times those of a tint (3,)."""

    def times(colour: Sequence[float]) -> tuple[float, float, float]:
        red, green, blue = (float(value) for value in np.asarray(colour) * tint)
        return red, green, blue

    lamps = tuple(replace(lamp, colour=times(lamp.colour)) for lamp in light.lamps)
    return replace(light, lamps=lamps, ambient_colour=times(light.ambient_colour))


def chart_profile(flat: Stage, light: Light, rng: np.random.Generator) -> bytes:
    """ICC profile of a chart laid flat in a light, as the camera records it."""
    codes = flat.print(chart_image())
    shot = picture(codes, light.level / max(1.0, float(light.level.max())), rng)
    return encode_profile(fit_colours(find_chart(shot)).profile("chart"))


def errors(
    stage: Stage, flat: Stage, image: Bytes, lamp: tuple[Light, Spot | None], rng: np.random.Generator
) -> tuple[list[float], bool]:
    """Mean ΔE2000 of a print (h, w, 3) under a lamp in the columns of COLUMNS, and whether bare paper was found."""
    light, spot = lamp
    codes, field = stage.print(image), stage.light(light, mean_albedo(image), spot)
    bright = max(1.0, float(np.percentile(field, 99)))  # the camera's exposure spares the highlights
    shot = picture(codes, field / bright, rng)
    seen, mask = stage.page(shot, DPI)
    even, _ = stage.page(picture(codes, np.full(3, light.level[1] / bright)), DPI)
    reach = 2 * round(BORDER_MM / MM_PER_INCH * DPI) + 1
    inner = cv2.erode(mask.astype(np.uint8), np.ones((reach, reach), np.uint8), borderValue=0) > 0
    kept = stage.find_light(shot).removed_from(seen, mask, DPI).image
    balance = balance_on_paper(kept, mask, DPI)
    converted, _ = image_to_srgb(kept, chart_profile(flat, light, rng))
    found = [colour_error(page, even, inner) for page in (seen, kept, balance.image, converted)]
    return found, bool(balance.report["balanced"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line a page, and the means."""
    parser = argparse.ArgumentParser(description="colours of pages under tinted lamps, by the modes of --white-balance")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--sheet", action="append", choices=SHEETS, help=f"a kind of sheet ({', '.join(KINDS)})")
    parser.add_argument("--each", type=int, default=len(FAMILIES), help="pages of every sheet")
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: mean ΔE2000 to the same print in even, neutral light")
    print(ROW.format("sheet", "print", "lamp", "K", *COLUMNS), flush=True)
    flat, lamps, rows = Stage.of(Flat()), list(LAMPS), []
    for kind in options.sheet or KINDS:
        number = list(SHEETS).index(kind)
        rng = np.random.default_rng([seed, number])
        stage = Stage.of(SHEETS[kind](rng))
        for k in range(options.each):
            family, lamp = FAMILIES[(seed + k) % len(FAMILIES)], lamps[(seed + number + k) % len(lamps)]
            kelvin = 1e6 / rng.uniform(*MIREDS)
            light, spot = LAMPS[lamp](rng)
            image = PRINTS[family](rng, PAGE_MM)
            found, balanced = errors(stage, flat, image, (tinted(light, planckian(kelvin)), spot), rng)
            rows.append(found)
            mark = "" if balanced else "  no bare paper found"
            print(ROW.format(kind, family, lamp, f"{kelvin:.0f}", *(f"{e:.2f}" for e in found)) + mark, flush=True)
    print(ROW.format("median", "", "", "", *(f"{e:.2f}" for e in np.median(rows, axis=0))))
    print(ROW.format("mean", "", "", "", *(f"{e:.2f}" for e in np.mean(rows, axis=0))))


if __name__ == "__main__":
    main()

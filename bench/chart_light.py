"""What `planish colour` says of a chart on which light falls off, by cameras and lamps drawn afresh.

    python -m bench.chart_light [--seed N] [--each 3]

The chart lies flat; from its first patch to its last in a direction drawn at random, the light falls off by a share.
The camera mixes its channels, bends each by an exponent of its own, and has the sensor's noise. Mean ΔE2000 as sRGB,
by the profile, and on patches left out of the fit; `other colours` is the truth: colours that are on no chart, by the
same camera in even light, through the profile. `levels`: how many figures name a level of FADGI.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

import cv2
import numpy as np

from bench.light_prints import DPI
from bench.light_stage import Field, Stage
from bench.shading import PAGE_MM
from drivers.simulated import Chart, Flat
from drivers.simulated.imaging.colour import NOISE_CODES
from drivers.simulated.scene.albedo import linear, srgb
from restore.scan import Bytes, Ints
from restore.texture.page import MM_PER_INCH
from station.colour.chart import find_chart
from station.colour.figures import mean_differences, quality_figures
from station.colour.fit import ColourFit, fit_colours, linear_light
from station.colour.lab import difference, lab_of_linear

FALL_OFFS = (0.0, 0.15, 0.3, 0.55)
BRIGHT = 0.9  # of what the sensor holds, on white in the best of the light
MIXED = 0.15  # of a channel comes from the two others, at most
BENT = 0.05  # standard deviation of the exponents of the channels
OTHERS = 500  # colours
MARK = 6  # pixels of print to either side of a middle: two of the camera
HALF = 127  # codes
ROW = "{:>9} {:>9} {:>9} {:>12} {:>9} {:>14} {:>8}"
COLUMNS = ("fall-off", "found", "as sRGB", "by profile", "left out", "other colours", "levels")

Camera = Callable[[Field], Field]


def chart_image() -> Bytes:
    """(h, w, 3) the printed chart at the resolution of the stage's prints."""
    size = tuple(round(side / MM_PER_INCH * DPI) for side in PAGE_MM)
    return np.asarray(cv2.resize(Chart().print_on(PAGE_MM).image, size, interpolation=cv2.INTER_AREA))


def patch_middles(flat: Stage) -> tuple[Ints, Ints]:
    """Rows and columns of the pixels in which the camera of a flat stage sees the middles of the chart's patches."""
    marks = np.zeros_like(chart_image())
    for left, bottom, right, top in Chart().print_on(PAGE_MM).patches.values():
        col, row = (round(mm / MM_PER_INCH * DPI) for mm in ((left + right) / 2, PAGE_MM[1] - (bottom + top) / 2))
        marks[row - MARK : row + MARK, col - MARK : col + MARK] = 255
    rows, cols = np.nonzero((flat.print(marks) - flat.print(np.zeros_like(marks))).min(axis=2) > HALF)
    return rows, cols


def camera(rng: np.random.Generator) -> Camera:
    """A camera drawn at random: codes (…, 3), 0 to 255, of linear light (…, 3)."""
    shares = rng.uniform(0, MIXED / 2, (3, 3))
    matrix = shares + np.diag(1 - shares.sum(axis=1))
    exponents = 1 + BENT * rng.normal(size=3)

    def codes(light: Field) -> Field:
        return np.asarray(srgb((np.clip(light @ matrix.T, 0, 1) ** exponents).astype(np.float32)), np.float32)

    return codes


def shot(chart: Field, patches: tuple[Ints, Ints], seen_by: Camera, fall_off: float, rng: np.random.Generator) -> Bytes:
    """(480, 640, 3) a chart of codes (480, 640, 3) in light that falls off from its first patch to its last."""
    turn = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[: chart.shape[0], : chart.shape[1]]
    way = np.cos(turn) * x + np.sin(turn) * y
    ends = way[patches].min(), way[patches].max()
    light = BRIGHT * (1 - fall_off * np.clip((way - ends[0]) / (ends[1] - ends[0]), 0, 1))
    codes = seen_by(linear(chart) * light[..., None].astype(np.float32))
    return np.clip(np.rint(codes + rng.normal(0, NOISE_CODES, codes.shape)), 0, 255).astype(np.uint8)


def error_on_others(fit: ColourFit, seen_by: Camera, rng: np.random.Generator) -> float:
    """Mean ΔE2000, exposed alike, of colours that are on no chart, in even light, by the profile of a fit."""
    light = (rng.uniform(0.02, 0.85, (OTHERS, 3))).astype(np.float32)
    seen = linear_light(seen_by(BRIGHT * light), fit.exponent) @ fit.matrix.T
    level = float(np.median(seen.sum(axis=1) / light.sum(axis=1)))
    return float(difference(lab_of_linear(seen / level), lab_of_linear(light)).mean())


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line a chart."""
    parser = argparse.ArgumentParser(description="planish colour on charts in uneven light")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--each", type=int, default=3, help="charts of every fall-off")
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: a chart in uneven light, mean ΔE2000", ROW.format(*COLUMNS), sep="\n")
    flat, rng = Stage.of(Flat()), np.random.default_rng(seed)
    chart, patches = flat.print(chart_image()), patch_middles(flat)
    for fall_off in FALL_OFFS:
        for _ in range(options.each):
            seen_by = camera(rng)
            fit = fit_colours(find_chart(shot(chart, patches, seen_by, fall_off, rng)))
            errors = [f"{error:.2f}" for error in mean_differences(fit).values()]
            levels = sum(figure.get("FADGI") is not None for figure in quality_figures(fit))
            others = f"{error_on_others(fit, seen_by, rng):.2f}"
            print(ROW.format(f"{fall_off:.2f}", f"{fit.fall_off:.2f}", *errors, others, levels), flush=True)


if __name__ == "__main__":
    main()

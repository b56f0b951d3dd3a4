"""Light taken out of pages whose sheets, prints and lamps are drawn afresh at every run.

    python -m bench.light_families [--seed N] [--sheet KIND]... [--each 8]

A sheet is bent at random and scanned; `--each` families of `bench.light_prints` are printed on it, each under a lamp of
another family. The table gives the mean ΔE2000 to the same print in even light, exposed alike, over the whole page:
with its light kept, with it removed, divided by its background, and by multi-scale Retinex (Jobson, Rahman & Woodell,
IEEE Trans. Image Processing 6(7), 1997). White paper is what is scanned: what ink does to the laser is another bench's.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from bench.light_draws import LAMPS, SHEETS
from bench.light_prints import PRINTS
from bench.light_stage import Stage, mean_albedo, picture
from bench.shading import PAGE_MM
from drivers.simulated.scene.albedo import LINEAR, srgb
from restore.scan import Bytes, Floats, Mask
from restore.shading.relief import Relief
from restore.shading.remove import LIGHT_DPI, find_light
from restore.texture.page import MM_PER_INCH
from station.colour.lab import difference, lab_of_linear

DPI = 100.0  # twice what the camera resolves
BORDER_MM = 2.0  # not measured: the outline is known to a sample
MAY_HARM, MEDIAN = 0.3, 2.0  # ΔE: above the page with its light kept, and over all pages
RETINEX_MM = (5.0, 20.0, 60.0)
BACKGROUND_MM = 8.0
SPARED = 7  # of the pixels one in so many is compared
SHRINK = 4  # of the pixels for a surround, whose widths are twenty of them and more


@dataclass(frozen=True, eq=False)
class Combination:
    """A page (h, w, 3) in some light, and the same in even light.

    mask, inner (h, w): where it is, and where it is measured. relief: its shape.
    cells (r, c, 3) and on_page (r, c): the page in its light painted at LIGHT_DPI.
    """

    names: tuple[str, str, str]
    seen: Bytes
    even: Bytes
    mask: Mask
    inner: Mask
    cells: Bytes
    on_page: Mask
    relief: Relief


def combinations(seed: int, kinds: Sequence[str], each: int) -> Iterator[Combination]:
    """Draw a sheet of every kind, and on each of them so many prints under as many lamps."""
    prints, lamps = list(PRINTS), list(LAMPS)
    turn = int(np.random.default_rng(seed).integers(len(prints)))
    for number, kind in enumerate(SHEETS):
        if kind not in kinds:
            continue
        rng = np.random.default_rng([seed, number])
        stage = Stage.of(SHEETS[kind](rng))
        for k in range(each):
            name, lamp = prints[(turn + number * each + k) % len(prints)], lamps[(number + k) % len(lamps)]
            image = PRINTS[name](rng, PAGE_MM)
            light, spot = LAMPS[lamp](rng)
            codes, field = stage.print(image), stage.light(light, mean_albedo(image), spot)
            bright = max(1.0, float(np.percentile(field, 99)))  # the camera's exposure spares the highlights
            shot = picture(codes, field / bright, rng)
            seen, mask = stage.page(shot, DPI)
            even, _ = stage.page(picture(codes, light.level / bright), DPI)
            reach = 2 * round(BORDER_MM / MM_PER_INCH * DPI) + 1
            inner = cv2.erode(mask.astype(np.uint8), np.ones((reach, reach), np.uint8), borderValue=0) > 0
            yield Combination((kind, name, lamp), seen, even, mask, inner, *stage.page(shot, LIGHT_DPI), stage.relief)


def colour_error(page: Bytes, even: Bytes, where: Mask) -> float:
    """Mean ΔE2000 of a page to the even one, exposed alike, at the pixels of a mask (one in SPARED)."""
    chosen = np.flatnonzero(where)[::SPARED]
    ours, truth = (LINEAR[one.reshape(-1, 3)[chosen]].astype(float) for one in (page, even))
    level = float(np.exp(np.median(np.log((ours.sum(axis=1) + 1e-3) / (truth.sum(axis=1) + 1e-3)))))
    return float(difference(lab_of_linear(ours), lab_of_linear(np.minimum(truth * level, 1))).mean())


def background_divided(page: Bytes, mask: Mask) -> Bytes:
    """A page divided, channel by channel, by its closed and blurred self, to white."""
    size = 2 * round(BACKGROUND_MM / 2 / MM_PER_INCH * DPI) + 1
    known = np.where(mask[..., None], page, 0).astype(np.uint8)
    closed = cv2.morphologyEx(known, cv2.MORPH_CLOSE, np.ones((size, size), np.uint8))
    background = LINEAR[cv2.medianBlur(closed, size)]
    background = cv2.GaussianBlur(background, (0, 0), size / 2)
    light = LINEAR[page] / np.maximum(background, 1e-3) * LINEAR[page[mask]].max(axis=0)
    return np.asarray(np.where(mask[..., None], np.rint(srgb(light)), page).astype(np.uint8))


def retinex(page: Bytes, mask: Mask) -> Bytes:
    """A page less its surroundings, in logarithms and at three scales, at the contrast and the mean that it had."""
    inside = mask.astype(np.float32)
    logs = np.log(LINEAR[page] + 1e-3) * inside[..., None]
    surround = np.zeros_like(logs)
    small = tuple(-(-n // SHRINK) for n in mask.shape[::-1])
    few, within = (cv2.resize(field, small, interpolation=cv2.INTER_AREA) for field in (logs, inside))
    for sigma in (mm / MM_PER_INCH * DPI / SHRINK for mm in RETINEX_MM):
        weight = np.maximum(cv2.GaussianBlur(within, (0, 0), sigma), 1e-3)
        smooth = cv2.GaussianBlur(few, (0, 0), sigma) / weight[..., None]
        surround += cv2.resize(smooth, mask.shape[::-1], interpolation=cv2.INTER_LINEAR) / len(RETINEX_MM)
    rest = logs - surround
    rest += logs[mask].mean(axis=0) - rest[mask].mean(axis=0)
    return np.asarray(np.where(mask[..., None], np.rint(srgb(np.exp(rest))), page).astype(np.uint8))


def measured(one: Combination) -> tuple[tuple[float, ...], bool]:
    """Mean ΔE of a page with its light kept, removed, divided by its background, and by Retinex; and whether the
    removal left the light on the page."""
    result = find_light(one.cells, one.on_page, one.relief).removed_from(one.seen, one.mask, DPI)
    pages = (one.seen, result.image, background_divided(one.seen, one.mask), retinex(one.seen, one.mask))
    return tuple(colour_error(page, one.even, one.inner) for page in pages), not result.report["removed"]


ROW = "{:<11} {:<15} {:<12}" + " {:>10}" * 4
COLUMNS = ("kept", "removed", "background", "Retinex")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line a combination, the medians, and what falls short."""
    parser = argparse.ArgumentParser(description="light removed from pages drawn at random")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--sheet", action="append", choices=SHEETS, help="a kind of sheet (all)")
    parser.add_argument("--each", type=int, default=8, help="prints on every sheet")
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: mean ΔE2000 to the same print in even light")
    print(ROW.format("sheet", "print", "lamp", *COLUMNS))
    prints, errors, left = [], [], 0
    for one in combinations(seed, options.sheet or tuple(SHEETS), options.each):
        found, as_it_was = measured(one)
        prints.append(one.names[1])
        errors.append(found)
        left += as_it_was
        mark = "  worse than kept" if found[1] > found[0] + MAY_HARM else "  light kept" if as_it_was else ""
        print(ROW.format(*one.names, *(f"{error:.2f}" for error in found)) + mark, flush=True)
    print(*summary(prints, np.array(errors), left), sep="\n")


def summary(prints: Sequence[str], errors: Floats, left: int) -> Iterator[str]:
    """Lines on errors (n, 4) of n prints: the mean of each family, and over all; `left` pages kept their light."""
    for name in dict.fromkeys(prints):
        of_it = errors[np.array(prints) == name]
        yield ROW.format("mean", name, f"of {len(of_it)}", *(f"{value:.2f}" for value in of_it.mean(axis=0)))
    for name, figure in (("median", np.median), ("mean", np.mean), ("worst", np.max)):
        yield ROW.format(name, "", "", *(f"{value:.2f}" for value in figure(errors, axis=0)))
    harm = errors[:, 1] - errors[:, 0]
    yield f"{len(errors)} combinations, the light kept on {left}; worse than kept by more than {MAY_HARM}: " + (
        f"{(harm > MAY_HARM).sum()} (most {harm.max():+.2f}); median {np.median(errors[:, 1]):.2f} ≤ {MEDIAN}"
    )


if __name__ == "__main__":
    main()

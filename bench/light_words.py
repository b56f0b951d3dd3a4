"""Words read on creased and curled sheets under lamps drawn afresh, with their light and without it.

    python -m bench.light_words [--seed N] [--sheet KIND]... [--each 2] [--finer 2]

The flat original is the same print laid flat in even light before the same camera; `even` is the bent page in even
light, the most that taking out its light can do. With --finer the camera has so many times the scanner's pixels across
and down: what words gain by that is the resolution's. Precision in per cent, all pictures read alike by Tesseract.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from bench.light_draws import LAMPS, SHEETS
from bench.light_prints import DPI as PRINT_DPI
from bench.light_stage import SUBSAMPLES, Stage, mean_albedo, picture
from bench.shading import PAGE_MM
from bench.words import DPI, MARGIN_MM, TITLE_PT, TYPE_PT
from drivers.simulated import Flat, Text
from restore.scan import Bytes
from station.words.ocr_precision import count_matching_words
from station.words.words import recognise

KINDS = ("Miura", "gutter", "curl", "wave")
COLUMNS = ("kept", "removed", "even", "flat original")
ROW = "{:<11} {:<12}" + " {:>14}" * 4


def precision(stage: Stage, flat: Stage, lamp: str, rng: np.random.Generator) -> list[float]:
    """Per cent of the words read right in the pictures of COLUMNS, on a page with other sentences each time."""
    seed = int(rng.integers(1 << 16))
    design = Text(title_pt=TITLE_PT, sizes_pt=(TYPE_PT,), margin_mm=MARGIN_MM, seed=seed, dpi=PRINT_DPI)
    printed = design.print_on(PAGE_MM)
    light, spot = LAMPS[lamp](rng)
    codes, field = stage.print(printed.image), stage.light(light, mean_albedo(printed.image), spot)
    bright = max(1.0, float(np.percentile(field, 99)))  # the camera's exposure spares the highlights
    shot = picture(codes, field / bright, rng)
    kept, mask = stage.page(shot, DPI)
    pages: tuple[Bytes, ...] = (
        kept,
        stage.find_light(shot).removed_from(kept, mask, DPI).image,
        stage.page(picture(codes, light.level / bright, rng), DPI)[0],
        flat.page(picture(flat.print(printed.image), light.level / bright, rng), DPI)[0],
    )
    words = " ".join(word.text for word in printed.words)
    texts = (recognise(page, DPI, name=name).text for name, page in zip(COLUMNS, pages, strict=True))
    return [100 * count_matching_words(words, text).precision for text in texts]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line a page, and a line a kind of sheet with its mean."""
    parser = argparse.ArgumentParser(description="words read on creased and curled sheets under random lamps")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--sheet", action="append", choices=SHEETS, help=f"a kind of sheet ({', '.join(KINDS)})")
    parser.add_argument("--each", type=int, default=2, help="pages of every sheet")
    parser.add_argument(
        "--finer",
        type=int,
        default=1,
        choices=range(1, SUBSAMPLES + 1),
        help="pixels of the camera to one of the scanner's",
    )
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: words read right, per cent, {TYPE_PT:g} pt")
    print(ROW.format("sheet", "lamp", *COLUMNS))
    flat, lamps = Stage.of(Flat(), finer=options.finer), list(LAMPS)
    for kind in options.sheet or KINDS:
        number = list(SHEETS).index(kind)
        rng = np.random.default_rng([seed, number])
        stage = Stage.of(SHEETS[kind](rng), finer=options.finer)
        rows = []
        for k in range(options.each):
            lamp = lamps[(seed + number + k) % len(lamps)]
            rows.append(precision(stage, flat, lamp, rng))
            print(ROW.format(kind, lamp, *(f"{value:.1f}" for value in rows[-1])), flush=True)
        print(ROW.format(kind, "mean", *(f"{value:.1f}" for value in np.mean(rows, axis=0))), flush=True)


if __name__ == "__main__":
    main()

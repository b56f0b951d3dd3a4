"""Words that the camera resolves on the bent pages of `bench.words`: the most that a restoration can read of them.

    python -m bench.words_resolved [--seed N] [--only WARP]...

Every page is shot in even light and laid flat by its true shape, so that neither light nor shape is left to find, and
read beside the flat original. What is missed on the first alone is the camera's: on a slope it has fewer pixels to the
millimetre, and rows that do not follow the lines of text. Precision as in `bench.words`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from string import punctuation

import numpy as np
from rapidfuzz.distance import Levenshtein

from bench.words import DPI, OPTICS, WARPS, Task, print_of, sampled_flat, tasks
from drivers.simulated import Flat, Pose, shoot
from drivers.simulated.scene.light import Light
from station.words.ocr_precision import count_matching_words
from station.words.words import recognise

EVEN = Light((), 1.0)
ROW = "{:<14} {:<12} {:>10} {:>14} {:>10}"


def measure(task: Task) -> tuple[float, float, int, int]:
    """Per cent of the words read right on the bent page and on the flat original; how many words are missed on the bent
    page, and how many of these for a mark of punctuation alone."""
    design = print_of(task)
    scan, truth = shoot(task.sheet, design, seed=task.seed, pose=Pose(tilt_deg=task.tilt_deg), light=EVEN, **OPTICS)
    bent, flat = sampled_flat(scan, truth), sampled_flat(*shoot(Flat(), design, seed=task.seed, **OPTICS))
    printed = " ".join(word.text for word in truth.words)
    of_bent, of_flat = (recognise(page, DPI, name="page").text for page in (bent, flat))
    ours, ceiling = (count_matching_words(printed, read) for read in (of_bent, of_flat))
    return 100 * ours.precision, 100 * ceiling.precision, ours.total - ours.correct, marks_missed(printed, of_bent)


def marks_missed(printed: str, read: str) -> int:
    """Number of words that are read as printed but for their punctuation."""
    ours, theirs = printed.split(), read.split()
    pairs = ((ours[i], theirs[j]) for kind, i, j in Levenshtein.editops(ours, theirs) if kind == "replace")
    return sum(one.strip(punctuation) == other.strip(punctuation) for one, other in pairs)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a line a page, and a line a warp with its mean."""
    parser = argparse.ArgumentParser(description="words that the camera resolves on bent pages")
    parser.add_argument("--seed", type=int, default=None, help="drawn, and printed, unless given")
    parser.add_argument("--only", action="append", choices=WARPS, help="a warp: the same pages as in bench.words")
    options = parser.parse_args(arguments)
    seed = options.seed if options.seed is not None else int(np.random.SeedSequence().entropy) % (1 << 31)
    print(f"seed {seed}: words read right, per cent, pages bent in even light and laid flat by their true shape")
    print(ROW.format("warp", "", "bent page", "flat original", "marks"))
    for warp in options.only or WARPS:
        rows = []
        for task in (task for task in tasks(seed) if task.warp == warp):
            bent, flat, missed, marks = measure(task)
            rows.append((bent, flat, missed, marks))
            print(
                ROW.format(warp, f"{task.tilt_deg:.1f}°", f"{bent:.1f}", f"{flat:.1f}", f"{marks} of {missed}"),
                flush=True,
            )
        bent, flat, missed, marks = np.transpose(rows)
        cells = f"{bent.mean():.1f}", f"{flat.mean():.1f}", f"{marks.sum():.0f} of {missed.sum():.0f}"
        print(ROW.format(warp, "mean", *cells), flush=True)


if __name__ == "__main__":
    main()

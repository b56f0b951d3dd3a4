"""`python -m bench.plates [--count 40] [--seed 0] [--mode fast]`: what is printed over a spine, and next to it.

Half of the openings, of all families in turn, have one print across both pages: none of them may be cut through it.
The others have a print on each page: they are to be split, or asked for, with each word whole on one leaf.
"""

from __future__ import annotations

import argparse
from collections import Counter
from typing import Literal

from bench.spreads import SETTINGS, words_cut
from oracles.leaf_sides import is_printed_over
from oracles.openings import draw_opening, shoot_drawn
from restore import find_leaves, restore


def main(count: int, seed: int, mode: Literal["fast", "fine"]) -> None:
    """Print a line for each opening, then what became of plates and text, and what was cut."""
    advice: dict[str, Counter[str]] = {"plate": Counter(), "text": Counter()}
    words = cuts = wrong = 0
    for number in range(seed, seed + count):
        drawn = draw_opening(number // 2, plate=number % 2 == 0)
        assert drawn.spine_mm is not None
        shot = shoot_drawn(drawn, number, mode)
        if shot is None:
            print(f"{number:5} {drawn.family:12} folds over itself", flush=True)
            continue
        scan, truth = shot
        over = is_printed_over(truth.printed, drawn.spine_mm)
        leaves = find_leaves(scan, "auto", SETTINGS)
        kind, found = "plate" if over else "text", leaves.finding
        advice[kind][found.advice] += 1
        words += len(truth.words)
        line = (
            f"{number:5} {drawn.family:12} {drawn.artwork.name:10} {kind:6} {found.advice:6} {found.crossing or 0:.4f}"
        )
        if found.advice == "split":
            wrong += over
            cut = words_cut({side: restore(sheet, SETTINGS) for side, sheet in leaves.parts.items()}, scan, truth)
            cuts += cut
            line += f" words cut {cut} of {len(truth.words)}"
        print(line, flush=True)
    for kind, counts in advice.items():
        print(f"{kind:6} {dict(counts)}")
    print(f"cut through print: {wrong} openings, {cuts} of {words} words")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--mode", choices=["fast", "fine"], default="fast")
    main(**vars(parser.parse_args()))

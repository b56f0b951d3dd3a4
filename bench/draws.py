"""What benches share that draw their cases afresh at every run."""

from __future__ import annotations

import argparse
import datetime
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from restore import RangeScan

PRINTS = ("markers", "text", "white", "figure")


def seed_of_today() -> int:
    """The date of today as a number, 20260101 and so on."""
    return int(datetime.date.today().strftime("%Y%m%d"))


def draws_parser(description: str | None, count: int) -> argparse.ArgumentParser:
    """A parser of --count, how many cases are drawn, and of --seed."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int)
    return parser


def run(main: Callable[[int, int | None], None], description: str | None, count: int) -> None:
    """Call main(count, seed) with those of the command line."""
    options = draws_parser(description, count).parse_args()
    main(options.count, options.seed)


def lossy(scan: RangeScan, share: float, rng: np.random.Generator) -> RangeScan:
    """A scan without a share of its samples, whichever they are."""
    points = scan.points.copy()
    points[rng.random(points.shape[:2]) < share] = np.nan
    return replace(scan, points=points)

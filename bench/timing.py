"""Median run times, interleaved."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

REPEATS = 5


def median_seconds(run: Callable[[], object]) -> float:
    """Median seconds of REPEATS runs, after one to warm up."""
    return in_turns(run)[0]


def in_turns(*runs: Callable[[], object]) -> list[float]:
    """Median seconds of each function, their runs interleaved: a machine that slows down slows all of them."""
    taken = []
    for _ in range(REPEATS + 1):
        seconds = []
        for run in runs:
            start = time.perf_counter()
            run()
            seconds.append(time.perf_counter() - start)
        taken.append(seconds)
    return [statistics.median(of_one) for of_one in zip(*taken[1:], strict=True)]

"""The end of a batch is named as an interval that holds."""

from __future__ import annotations

import heapq

import numpy as np
import pytest

from station.batch.estimate import MIN_PAGES, Estimate

TRIALS, PAGES = 200, 120
HELD = 0.9  # of the intervals: they are made for 95 % of normal errors, and these are not normal
NARROWER = 0.5  # of the width after a quarter, when three quarters are known; an endless interval would always hold


def makespan(seconds, workers: int) -> float:
    """Seconds until the last page is done, each handed to the worker that is free first."""
    free = [0.0] * workers
    for one in seconds:
        heapq.heapreplace(free, free[0] + one)
    return max(free)


@pytest.mark.parametrize("workers", [1, 2, 16])
@pytest.mark.parametrize("fixed", [0.0, 8.0])
def test_the_interval_holds_what_comes(workers, fixed) -> None:
    rng, held, widths, later = np.random.default_rng(3), 0, [], []
    for _ in range(TRIALS):
        sizes = np.sort(rng.integers(1_000_000, 6_000_000, PAGES))[::-1]
        seconds = (fixed + sizes / 500_000) * rng.lognormal(0.0, 0.3, PAGES)
        for done, into in ((PAGES // 4, widths), (3 * PAGES // 4, later)):
            least, most = Estimate(list(sizes[:done]), list(seconds[:done])).remaining_s(list(sizes[done:]), workers)
            truth = makespan(seconds[done:], workers)
            held += least <= truth <= most
            into.append(most - least)
    assert held / (2 * TRIALS) > HELD
    assert np.median(later) < NARROWER * np.median(widths)


def test_nothing_is_named_before_the_scatter_is_known() -> None:
    estimate = Estimate()
    for _ in range(MIN_PAGES - 1):
        estimate.add(100, 1.0)
    assert estimate.remaining_s([100], 1) is None
    estimate.add(100, 1.0)
    assert estimate.remaining_s([100] * 10, 1) == pytest.approx((10.0, 10.0))
    assert estimate.remaining_s([], 1) == (0.0, 0.0)


def test_pages_of_exact_cost_have_an_exact_end() -> None:
    estimate = Estimate([100, 200, 300, 400, 500], [3.0, 5.0, 7.0, 9.0, 11.0])
    assert estimate.remaining_s([600, 600], 1) == pytest.approx((26.0, 26.0))


def test_seconds_that_fall_with_the_size_do_not_become_negative() -> None:
    estimate = Estimate([100, 200, 300, 400, 500], [5.0, 4.0, 3.0, 2.0, 1.0])
    least, most = estimate.remaining_s([10_000], 1)
    assert 0 <= least <= most

"""Estimates when a batch ends, as an interval, from seconds and bytes of finished pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import stdtrit

from restore.scan import Floats

MIN_PAGES = 5  # before that the scatter is not known, and no end is named
COVERED = 0.95


@dataclass
class Estimate:
    """Seconds of pages, learned as they are done: a line over the bytes of their files."""

    sizes: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def add(self, size: int, seconds: float) -> None:
        """Take a page that is done: bytes of its files, seconds of one worker."""
        self.sizes.append(size)
        self.seconds.append(seconds)

    def remaining_s(self, sizes: Sequence[int], workers: int) -> tuple[float, float] | None:
        """Return the least and the greatest likely seconds for pages.

        Handed out longest first, the pages end within the mean load and the longest page (R. L. Graham, "Bounds on
        multiprocessing timing anomalies", SIAM J. Appl. Math. 17(2), 1969).
        sizes: of the pages, bytes.
        Returns None while they are unknown.
        """
        if len(self.sizes) < MIN_PAGES:
            return None
        if not sizes:
            return 0.0, 0.0
        known, seconds, left = (np.asarray(values, float) for values in (self.sizes, self.seconds, sizes))
        totals = [_proportional(known, seconds, left), _constant(seconds, left)]
        # Pages cost something besides their bytes, and never less for more of them: between these two lies every line.
        least, most = max(min(low for low, _ in totals), 0.0), max(high for _, high in totals)
        if (line := _line(known, seconds, left)) is not None:
            least, most = (min(max(one, least), most) for one in line)
        return least / workers, most / workers + float(seconds.max()) * (1 - 1 / workers)


def _proportional(known: Floats, seconds: Floats, left: Floats) -> tuple[float, float]:
    """Return the likely range of a sum over sizes `left`, seconds proportional to size.

    Returns the least and the greatest.
    """
    ratios = seconds / np.maximum(known, 1.0)
    total = float(ratios.mean() * left.sum())
    return _around(total, ratios.std(ddof=1) * np.sqrt((left**2).sum() + left.sum() ** 2 / len(known)), len(known) - 1)


def _constant(seconds: Floats, left: Floats) -> tuple[float, float]:
    """The same if they do not depend on the size."""
    count, known = len(left), len(seconds)
    return _around(float(seconds.mean() * count), seconds.std(ddof=1) * np.sqrt(count + count**2 / known), known - 1)


def _line(known: Floats, seconds: Floats, left: Floats) -> tuple[float, float] | None:
    """Return the likely range of a sum by a line of least squares.

    Its slope is as uncertain as it is; None where all sizes are equal.
    """
    spread = known - known.mean()
    squares = float(spread @ spread)
    if not squares:
        return None
    slope = float(spread @ seconds / squares)
    residuals = seconds - seconds.mean() - slope * spread
    away = float((left - known.mean()).sum())
    count, freedom = len(left), len(known) - 2
    scatter = np.sqrt(residuals @ residuals / freedom)
    total = float(seconds.mean()) * count + slope * away
    return _around(total, scatter * np.sqrt(count + count**2 / len(known) + away**2 / squares), freedom)


def _around(total: float, deviation: float, freedom: int) -> tuple[float, float]:
    error = float(stdtrit(freedom, (1 + COVERED) / 2) * deviation)
    return total - error, total + error

"""Work on bands of rows in parallel threads: compiled kernels release the interpreter lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

THREADS = 2  # more gain little: the kernels are bound by memory bandwidth
BANDS = 8  # more than threads, so that a busy core gets fewer of them


def in_bands(work: Callable[[slice], None], rows: int, height: int | None = None) -> None:
    """Call work(rows of a band) for all rows, in any order; bands of a given height, or a few of equal heights."""
    edges = [rows * k // BANDS for k in range(BANDS + 1)] if height is None else [*range(0, rows, height), rows]
    with ThreadPoolExecutor(THREADS) as threads:
        list(threads.map(work, (slice(a, b) for a, b in pairwise(edges) if b > a)))

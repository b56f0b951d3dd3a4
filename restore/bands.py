"""Work on bands of rows, on two cores at once: compiled kernels let go of the interpreter."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

THREADS = 2  # more gain little: the bands go through the same memory
BANDS = 8  # so that a core that is busy with something else gets fewer of them


def in_bands(work: Callable[[slice], None], rows: int, height: int | None = None) -> None:
    """Call work(rows of a band) for all rows, in any order; bands of a given height, or a few of equal heights."""
    edges = [rows * k // BANDS for k in range(BANDS + 1)] if height is None else [*range(0, rows, height), rows]
    with ThreadPoolExecutor(THREADS) as threads:
        list(threads.map(work, (slice(a, b) for a, b in pairwise(edges) if b > a)))

"""Work in parallel threads, on bands of rows or other parts: compiled kernels release the interpreter lock."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TypeVar

THREADS = 2  # more gain little: the kernels are bound by memory bandwidth
BANDS = 8  # more than threads, so that a busy core gets fewer of them

Part = TypeVar("Part")
Result = TypeVar("Result")


def in_threads(work: Callable[[Part], Result], parts: Iterable[Part]) -> list[Result]:
    """The results of work(part) for all parts, in their order."""
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(work, parts))


def in_bands(work: Callable[[slice], None], rows: int, height: int | None = None) -> None:
    """Call work(rows of a band) for all rows, in any order; bands of a given height, or a few of equal heights."""
    edges = [rows * k // BANDS for k in range(BANDS + 1)] if height is None else [*range(0, rows, height), rows]
    in_threads(work, (slice(a, b) for a, b in pairwise(edges) if b > a))

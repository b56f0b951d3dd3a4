"""Work in parallel threads, on bands of rows or other parts.

Compiled kernels release the interpreter lock.
"""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import TypeVar

VARIABLE = "PLANISH_THREADS"  # set for the processes of a pool, which divide the processors
MAX_THREADS = 4  # more gain little: the kernels are bound by memory bandwidth
BANDS_A_THREAD = 2  # more than one, so that a busy core gets fewer of them
BAND_PIXELS = 2**18  # of a band of a picture: what is computed of it on the way stays in the processor's cache

_inside = threading.local()  # .busy in a thread that works on parts

Part = TypeVar("Part")
Result = TypeVar("Result")


@cache
def thread_count() -> int:
    """Return the number of threads: usable processors up to MAX_THREADS, or PLANISH_THREADS."""
    given = os.environ.get(VARIABLE, "")
    if given.isascii() and given.isdigit() and int(given) > 0:
        return int(given)
    return min(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1, MAX_THREADS)


def in_threads(work: Callable[[Part], Result], parts: Iterable[Part], count: int | None = None) -> list[Result]:
    """Return the results of work(part) for all parts, in their order.

    Once one has failed, no other is begun. Work that calls this again does so in its own thread.
    count: number of threads, this one included; `thread_count()` by default. It does not change any result.
    """
    numbered = [*enumerate(parts)]
    count = min(count or thread_count(), max(len(numbered), 1))
    waiting: deque[tuple[int, Part] | None] = deque([*numbered, *[None] * count])  # a thread ends at a None
    results: dict[int, Result] = {}

    def work_off() -> None:
        _inside.busy = count >= thread_count()
        try:
            while (one := waiting.popleft()) is not None:
                results[one[0]] = work(one[1])
        finally:
            _inside.busy = False
            waiting.appendleft(None)

    if count == 1 or getattr(_inside, "busy", False):
        return [work(part) for _, part in numbered]
    # This thread works, too: until another has started, or is awake again, small parts are done.
    with ThreadPoolExecutor(count - 1) as threads:  # it starts a thread when work is submitted
        others = [threads.submit(work_off) for _ in range(count - 1)]
        work_off()
    for other in others:
        other.result()
    return [results[number] for number in range(len(results))]


def in_bands(work: Callable[[slice], None], rows: int, height: int | None = None) -> None:
    """Call work(rows of a band) for all rows, in any order.

    Bands have a given height, or a few have equal heights.
    """
    count = BANDS_A_THREAD * thread_count()
    equal = [rows * k // count for k in range(count + 1)]
    edges = equal if height is None else [*range(0, rows, height), rows]
    in_threads(work, (slice(a, b) for a, b in pairwise(edges) if b > a))


def in_picture_bands(work: Callable[[slice], None], rows: int, cols: int) -> None:
    """Call work(rows of a band) for all rows of a picture, in any order.

    A band has about BAND_PIXELS.
    """
    in_bands(work, rows, max(1, BAND_PIXELS // max(cols, 1)))

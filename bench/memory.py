"""How much the process grows while something runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

PROCESS = Path("/proc/self")
RESET_PEAK = "5"  # man 5 proc, clear_refs: the peak of the resident set starts again from here


@contextmanager
def peak_growth_mb() -> Iterator[Callable[[], float]]:
    """Yields what tells, after the block, by how many MB the resident set had grown at its peak.

    Linux only; memory that was freed but kept for reuse counts as the process's own from the start.
    """
    (PROCESS / "clear_refs").write_text(RESET_PEAK)
    start, end = _status_mb("VmRSS"), [0.0]
    yield lambda: end[0] - start
    end[0] = _status_mb("VmHWM")


def _status_mb(field: str) -> float:
    line = next(line for line in (PROCESS / "status").read_text().splitlines() if line.startswith(field + ":"))
    return float(line.split()[1]) / 1024

"""Growth of the resident set of the process while a block runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

PROCESS = Path("/proc/self")
RESET_PEAK = "5"  # man 5 proc, clear_refs: the peak of the resident set starts again from here


@contextmanager
def peak_growth_mb() -> Iterator[Callable[[], float]]:
    """Yields a function that returns, after the block, the peak growth of the resident set, MB.

    Linux only; memory that was freed but kept for reuse counts as the process's own from the start.
    """
    (PROCESS / "clear_refs").write_text(RESET_PEAK)
    start, end = status_mb("VmRSS"), [0.0]
    yield lambda: end[0] - start
    end[0] = status_mb("VmHWM")


def status_mb(field: str) -> float:
    """A field of the process's status, MB: VmRSS the resident set now, VmHWM its peak, VmSize the address space."""
    line = next(line for line in (PROCESS / "status").read_text().splitlines() if line.startswith(field + ":"))
    return float(line.split()[1]) / 1024

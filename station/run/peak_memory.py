"""Peak resident memory of this process."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from resource import RUSAGE_SELF, getrusage

STATUS = Path("/proc/self/status")


def peak_memory_mib() -> float:
    """Peak resident memory of this program, MiB.

    Where there is /proc (Linux), its VmHWM: that of getrusage, which is taken elsewhere, is inherited from the program
    that started this one.
    """
    with suppress(OSError):
        for line in STATUS.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
    return getrusage(RUSAGE_SELF).ru_maxrss / 1024  # KiB, as Linux and BSD count

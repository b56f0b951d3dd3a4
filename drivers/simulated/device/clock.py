"""A virtual clock: time passes only in `sleep`."""

from __future__ import annotations


class VirtualClock:
    """A clock in seconds: calling it returns the time, `sleep` advances it."""

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def __call__(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        """Advance the time."""
        self._now += max(seconds, 0.0)

"""Time that passes only when someone waits for it."""

from __future__ import annotations


class VirtualClock:
    """A clock in seconds. Calling it tells the time; `sleep` is how it passes."""

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def __call__(self) -> float:
        return self._now

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        self._now += max(seconds, 0.0)

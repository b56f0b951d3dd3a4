"""What turns: an axle with a stepper motor, whose place follows from the time."""

from __future__ import annotations


class Axle:
    """Axle that stands or moves evenly: pulses, and seconds of the caller's clock."""

    def __init__(self, position: float = 0.0) -> None:
        self._from = self._to = position
        self._start = self._end = 0.0

    def position(self, now: float) -> float:
        """Where it is."""
        if now >= self._end:
            return self._to
        return self._from + (self._to - self._from) * (now - self._start) / (self._end - self._start)

    def moving(self, now: float) -> bool:
        """Whether it has not arrived."""
        return now < self._end

    def go(self, to: float, pulses_per_s: float, now: float) -> None:
        """Set out for a position."""
        self._from, self._to = self.position(now), to
        self._start, self._end = now, now + abs(self._to - self._from) / pulses_per_s

    def halt(self, now: float) -> None:
        """Stop where it is."""
        self._from = self._to = self.position(now)
        self._end = now

    def count_from(self, position: float) -> None:
        """Call the place where it stands `position`."""
        self._from = self._to = position

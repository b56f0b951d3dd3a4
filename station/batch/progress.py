"""How far a batch is, and between which times it ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta

from station.batch.estimate import Estimate
from station.intake import records


@dataclass(frozen=True)
class Event:
    """A page that was settled, or a session that is left out.

    state, its name, where the result is or why there is none, how far the batch is.
    """

    state: str
    name: str
    text: str
    progress: str


Show = Callable[[Event], None]


class Pace:
    """The pages that are left, by their sizes, and the seconds of those that are done."""

    def __init__(self, sizes: Iterable[int], now: Callable[[], datetime] = records.utc) -> None:
        self._left = Counter(sizes)
        self._total = self._left.total()
        self._estimate, self._now = Estimate(), now

    def done(self, size: int, seconds: float, workers: int) -> str:
        """Take a page that is done. Returns how many are, and the local times between which the batch ends."""
        self._left[size] -= 1
        self._estimate.add(size, seconds)
        remaining = self._estimate.remaining_s(list(self._left.elements()), workers)
        return f"{self._total - self._left.total()} of {self._total}{self._end(remaining)}"

    def _end(self, remaining: tuple[float, float] | None) -> str:
        """To the minute; nothing while it is not known."""
        if remaining is None:
            return ""
        now = self._now().astimezone()
        early, late = (now + timedelta(seconds=seconds) for seconds in remaining)
        day = "%a %H:%M" if late - now > timedelta(days=1) else "%H:%M"
        first, last = early.strftime(day), late.strftime(day)
        return f", ends {first}" if first == last else f", ends {first} to {last}"

"""How far a batch is, and between which times it ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import datetime, timedelta

from station.batch.estimate import Estimate
from station.intake import records


@dataclass(frozen=True)
class Done:
    """State of a batch: pages done by `now`, and when it ends.

    The end is between two local times, once these are known.
    """

    done: int
    total: int
    now: datetime
    ends: tuple[datetime, datetime] | None = None

    @property
    def fraction(self) -> float:
        """The fraction of the pages that is done."""
        return self.done / self.total

    def __str__(self) -> str:
        """The end to the minute, with its day when it is more than a day away."""
        if self.ends is None:
            return f"{self.done} of {self.total}"
        day = "%a %H:%M" if self.ends[1] - self.now > timedelta(days=1) else "%H:%M"
        first, last = (end.strftime(day) for end in self.ends)
        return f"{self.done} of {self.total}, ends {first}" + (f" to {last}" if last != first else "")


@dataclass(frozen=True)
class Event:
    """Page that was settled, or a session that is left out.

    state: its name, where the result is or why it is missing, how far the batch is when a page was settled.
    """

    state: str
    name: str
    text: str
    done: Done | None = None


Show = Callable[[Event], None]


class Pace:
    """The pages that are left, by their sizes, and the seconds of those that are done."""

    def __init__(self, sizes: Iterable[int], now: Callable[[], datetime] = records.utc) -> None:
        self._left = Counter(sizes)
        self._total = self._left.total()
        self._estimate, self._now = Estimate(), now

    def done(self, size: int, seconds: float, workers: int) -> Done:
        """Take a page that is done. Returns how far the batch is."""
        self._left[size] -= 1
        self._estimate.add(size, seconds)
        remaining = self._estimate.remaining_s(list(self._left.elements()), workers)
        now = self._now().astimezone()
        ends = remaining and (now + timedelta(seconds=remaining[0]), now + timedelta(seconds=remaining[1]))
        return Done(self._total - self._left.total(), self._total, now, ends)

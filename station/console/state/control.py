"""Control: which tab of a browser acts.

The first one to come; others watch, until they take control or it has gone.
"""

from __future__ import annotations

import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from station.console.faults import ConsoleFault

TAB = re.compile(r"[A-Za-z0-9_-]{16,64}")
GONE_S = 10.0  # after which a tab without a stream is gone: a reload takes a second or two, a lost network some
PROGRAM = "program"  # what sends no tab: a program that uses the interface


@dataclass(frozen=True)
class Holder:
    """The tab in control: its id, since when, and its browser."""

    tab: str
    since: datetime
    agent: str


class Control:
    """The tab that acts. clock: seconds, monotonic; now: the time of day."""

    def __init__(self, clock: Callable[[], float], now: Callable[[], datetime]) -> None:
        self._clock, self._now = clock, now
        self._lock = threading.Lock()
        self._holder: Holder | None = None
        self._streams: dict[str, int] = {}
        self._left_at = 0.0

    def joined(self, tab: str, agent: str) -> bool:
        """Note a stream of a tab, which takes control where no tab has it.

        Returns whether control changed.
        """
        with self._lock:
            self._streams[tab] = self._streams.get(tab, 0) + 1
            return self._claim(tab, agent)

    def left(self, tab: str) -> None:
        """Note the end of a stream of a tab."""
        with self._lock:
            self._streams[tab] = self._streams.get(tab, 1) - 1
            if self._streams[tab] <= 0:
                del self._streams[tab]
                if self._holder is not None and self._holder.tab == tab:
                    self._left_at = self._clock()

    def require(self, tab: str, agent: str) -> bool:
        """Let a tab act.

        Returns whether control changed; raises ConsoleFault when another tab has it.
        """
        with self._lock:
            changed = self._claim(tab, agent)
            holder = self._holder
        if holder is not None and holder.tab != tab:
            raise ConsoleFault(
                "read_only",
                "another window has control",
                "take control, or go on there",
                held_by={"tab": holder.tab, "since": _stamp(holder.since), "agent": holder.agent},
            )
        return changed

    def take(self, tab: str, agent: str) -> None:
        """Give control to a tab."""
        with self._lock:
            self._holder = Holder(tab, self._now(), agent)
            self._left_at = self._clock()

    def release(self, tab: str) -> None:
        """Take control from a tab, if it has it."""
        with self._lock:
            if self._holder is not None and self._holder.tab == tab:
                self._holder = None

    def as_json(self) -> dict[str, Any]:
        """Who has control."""
        with self._lock:
            holder = None if self._is_gone() else self._holder
        if holder is None:
            return {"tab": None, "since": None, "agent": ""}
        return {"tab": holder.tab, "since": _stamp(holder.since), "agent": holder.agent}

    def _claim(self, tab: str, agent: str) -> bool:
        if self._holder is not None and self._holder.tab == tab:
            self._left_at = self._clock()
            return False
        if self._holder is not None and not self._is_gone():
            return False
        self._holder, self._left_at = Holder(tab, self._now(), agent), self._clock()
        return True

    def _is_gone(self) -> bool:
        holder = self._holder
        return holder is None or (holder.tab not in self._streams and self._clock() - self._left_at > GONE_S)


SYSTEMS = ("Android", "iPad", "iPhone", "Windows", "Mac", "Linux")
BROWSERS = {"Edg/": "Edge", "Firefox/": "Firefox", "Chrome/": "Chrome", "Safari/": "Safari"}


def agent_of(header: str) -> str:
    """A browser's `User-Agent` in words: `Firefox on Linux`; empty for what is unknown."""
    browser = next((name for mark, name in BROWSERS.items() if mark in header), "")
    system = next((name for name in SYSTEMS if name in header), "")
    return " on ".join(part for part in (browser, system) if part)


def _stamp(time: datetime) -> str:
    return time.isoformat(timespec="milliseconds").replace("+00:00", "Z")

"""Sends browsers the state, ten times a second at most, and changed rows, lines and jobs."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Any

from station.capture_loop.loop import Message
from station.console.shown_pages.rows import Row
from station.console.state.event_stream import EventStream
from station.console.state.jobs import Job

STATE_S = 0.1  # at least, between two states that are sent


class Broadcast:
    """Events of the web interface.

    Its methods may be called from any thread.
    state: gives the state as JSON values.
    """

    def __init__(self, event_stream: EventStream, state: Callable[[], dict[str, Any]]) -> None:
        self.event_stream, self._state = event_stream, state
        self._loop: asyncio.AbstractEventLoop | None = None
        self._planned = False
        self._sent: dict[int, Row] = {}

    def start(self) -> None:
        """Send from now on, in the running loop."""
        self._loop = asyncio.get_running_loop()
        self.event_stream.start()

    def stop(self) -> None:
        """Send nothing more."""
        self.event_stream.end()
        self._loop = None

    def changed(self) -> None:
        """Send the state soon; several changes are one event."""
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._plan)

    def all_changed(self) -> None:
        """Have the pages loaded again."""
        self._sent = {}
        self.event_stream.publish("pages", {})
        self.changed()

    def rows(self, rows: Sequence[Row]) -> None:
        """Send the rows that differ from those that were sent."""
        now = {row["page"]: row for row in rows}
        before, self._sent = self._sent, now
        if [*before] == [*now][: len(before)]:
            for number, row in now.items():
                if before.get(number) != row:
                    self.event_stream.publish("page", {"page": row})
        else:
            self.event_stream.publish("pages", {})
        self.changed()

    def line(self, message: Message, data: Mapping[str, Any] | None = None) -> None:
        """Send a line for the operator, with facts."""
        self.event_stream.publish("message", {**asdict(message), "data": dict(data or {})})

    def job(self, job: Job) -> None:
        """Send a job, with the last of its items."""
        self.event_stream.publish("job", job.as_json() | {"items": job.items[-1:]})
        self.changed()

    def _plan(self) -> None:
        if not self._planned and self._loop is not None:
            self._planned = True
            self._loop.call_later(STATE_S, self._send_state)

    def _send_state(self) -> None:
        self._planned = False
        if self.event_stream.count:
            with suppress(OSError, ValueError):  # of the disk: the next state is sent again
                self.event_stream.publish("state", self._state())

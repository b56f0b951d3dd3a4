"""Numbered events for browsers.

They are kept for those that were away for a moment, and bounded for each that is slow.
"""

from __future__ import annotations

import asyncio
import json
import secrets
from collections import deque
from collections.abc import Callable
from typing import Any

from station.console.faults import ConsoleFault

MAX_STREAMS = 32  # tabs of one station
KEPT = 500  # events: those of a few minutes of a busy shift
MAX_BEHIND = 200  # events that a stream may be behind; beyond, it has to load everything again
BEAT_S = 15.0  # between two comments on an idle stream, so that both ends notice a connection that is gone
RETRY_MS = 1000
# A stream that is refused does not keep its connection: thousands of them would take the places of other requests.
REFUSED = {"Retry-After": "5", "Connection": "close"}


class EventStream:
    """The streams of events and the latest events.

    `publish` may be called from any thread.
    """

    def __init__(self, *, max_streams: int = MAX_STREAMS, beat_s: float = BEAT_S) -> None:
        self.boot = secrets.token_hex(4)
        self._max_streams, self._beat_s = max_streams, beat_s
        self._loop: asyncio.AbstractEventLoop | None = None
        self._kept: deque[tuple[int, bytes]] = deque(maxlen=KEPT)
        self._last = 0
        self._streams: set[Subscription] = set()
        self._open = True

    def start(self) -> None:
        """Deliver from now on, in the running loop."""
        self._loop = asyncio.get_running_loop()

    def publish(self, name: str, data: Any) -> None:
        """Send an event to every stream. data: JSON values."""
        loop = self._loop
        if loop is None or loop.is_closed():
            return
        line = json.dumps(data, ensure_ascii=False, separators=(",", ":"))
        loop.call_soon_threadsafe(self._deliver, name, line)

    def end(self) -> None:
        """End every stream; new ones are refused."""
        self._open = False
        for subscription in list(self._streams):
            subscription.end()

    @property
    def count(self) -> int:
        """How many streams are open."""
        return len(self._streams)

    def check_free(self) -> None:
        """Raise ConsoleFault when there are as many streams as there may be."""
        if not self._open:
            raise ConsoleFault("ending", "the server is ending", headers=REFUSED)
        if len(self._streams) >= self._max_streams:
            raise ConsoleFault(
                "streams_full",
                f"{self._max_streams} pages are open already",
                "close one of them",
                headers=REFUSED,
            )

    def subscribe(self, since: str = "") -> Subscription:
        """Return a stream that has its place from now on, until it is closed.

        since: id of the last event that was received.
        Raises ConsoleFault when all places are taken.
        """
        self.check_free()
        subscription = Subscription(self._beat_s, self._streams.discard)
        self._streams.add(subscription)
        hello = _frame("hello", json.dumps({"boot": self.boot, "last": self._last}))
        subscription.put(b"retry: %d\n\n" % RETRY_MS + hello)
        for frame in self._missed(since):
            subscription.put(frame)
        return subscription

    def _missed(self, since: str) -> list[bytes]:
        """Return events after one, `reset` if some are gone, none for a stream that begins."""
        boot, _, number = since.partition("-")
        if not since:
            return []
        first = self._kept[0][0] if self._kept else self._last + 1
        if boot != self.boot or not number.isdecimal() or not first - 1 <= int(number[:18]) <= self._last:
            return [_frame("reset", "{}")]
        return [frame for at, frame in self._kept if at > int(number)]

    def _deliver(self, name: str, line: str) -> None:
        self._last += 1
        frame = _frame(name, line, f"{self.boot}-{self._last}")
        self._kept.append((self._last, frame))
        for subscription in self._streams:
            subscription.put(frame)


class Subscription:
    """The frames that one client has not taken yet, as an asynchronous iterator of bytes."""

    def __init__(self, beat_s: float, closed: Callable[[Subscription], None]) -> None:
        self._beat_s, self._close = beat_s, closed
        self._frames: deque[bytes] = deque()
        self._there = asyncio.Event()
        self._ended = False

    def __aiter__(self) -> Subscription:
        return self

    async def __anext__(self) -> bytes:
        try:
            async with asyncio.timeout(self._beat_s):
                return await self._get()
        except TimeoutError:
            return b": beat\n\n"

    def put(self, frame: bytes) -> None:
        """Add a frame; a client that is far behind has to load everything again."""
        if len(self._frames) >= MAX_BEHIND:
            self._frames.clear()
            self._frames.append(_frame("reset", "{}"))
        self._frames.append(frame)
        self._there.set()

    def end(self) -> None:
        """Let the client take what is there, and no more."""
        self._ended = True
        self._there.set()

    def close(self) -> None:
        """Give the place of the stream back."""
        self._close(self)

    async def _get(self) -> bytes:
        while not self._frames:
            if self._ended:
                raise StopAsyncIteration
            self._there.clear()
            await self._there.wait()
        frames = b"".join(self._frames)
        self._frames.clear()
        return frames


def _frame(name: str, line: str, number: str = "") -> bytes:
    """One event as it stands in the stream. line: without line breaks, as JSON has none."""
    head = f"id: {number}\n" if number else ""
    return f"{head}event: {name}\ndata: {line}\n\n".encode()

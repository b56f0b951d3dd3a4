"""Connections: uvicorn's HTTP/1 with limits on time and size of a request's head."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from enum import Enum
from http import HTTPStatus
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from station.console.http.guard import MAX_HEAD_BYTES

HEAD_S = 10.0  # for a handshake and a whole head: a browser sends it in one piece


class Phase(Enum):
    """Phase of a connection.

    SILENT: no complete head yet, or closing. IDLE: answered, and waiting for the next head. BUSY: being answered.
    """

    SILENT = "silent"
    IDLE = "idle"
    BUSY = "busy"


class Connection(h11.Connection):
    """HTTP/1 without I/O. refused: the status for the error that ended it."""

    refused = 400

    def next_event(self) -> Any:
        """The next event. Raises RemoteProtocolError, whose status is kept."""
        try:
            return super().next_event()
        except h11.RemoteProtocolError as error:
            self.refused = error.error_status_hint
            raise


class ConsoleProtocol(H11Protocol):
    """HTTP/1 over one connection.

    A head that is late gets 408, one that is too large 431, a damaged one 400.
    on_phase: called with every change of the phase, and with None at the end.
    """

    head_s = HEAD_S
    on_phase: Callable[[ConsoleProtocol, Phase | None], None] = staticmethod(lambda _connection, _phase: None)

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.conn = Connection(h11.SERVER, MAX_HEAD_BYTES)
        self._late: asyncio.TimerHandle | None = None
        self._accepted = self.loop.time()

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Wait for the first head, whose time began before the handshake."""
        super().connection_made(transport)
        self._expect_head(since=self._accepted)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._stop_waiting()
        super().connection_lost(exc)
        self.on_phase(self, None)

    def data_received(self, data: bytes) -> None:
        """Take bytes; the first ones of a head begin its time."""
        if self._late is None and self.conn.their_state is h11.IDLE:
            self._expect_head()
        super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._stop_waiting()
            self.on_phase(self, Phase.SILENT if self.transport.is_closing() else Phase.BUSY)

    def on_response_complete(self) -> None:
        """Wait for the rest of a head that came with the last request."""
        super().on_response_complete()
        if self.conn.their_state is h11.IDLE:
            self.on_phase(self, Phase.IDLE)
        elif self.transport.is_closing():
            self.on_phase(self, Phase.SILENT)
        if self.conn.their_state is h11.IDLE and self.conn.trailing_data[0]:
            self._expect_head()

    def send_400_response(self, msg: str) -> None:  # noqa: ARG002 — uvicorn's name for it
        """Refuse what is not a request, or not a body of the current one."""
        self._stop_waiting()
        if self.cycle is not None:
            self.cycle.disconnected = True
        self._refuse(HTTPStatus(self.conn.refused))  # type: ignore[attr-defined]

    def _refuse(self, status: HTTPStatus) -> None:
        if self.conn.our_state in (h11.IDLE, h11.SEND_RESPONSE) and not self.transport.is_closing():
            head = f"HTTP/1.1 {status.value} {status.phrase}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
            self.transport.write(head.encode())
        self.transport.close()

    def _expect_head(self, since: float | None = None) -> None:
        begun = self.loop.time() if since is None else since
        self._late = self.loop.call_at(begun + self.head_s, self._refuse, HTTPStatus.REQUEST_TIMEOUT)

    def _stop_waiting(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None

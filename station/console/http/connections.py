"""Connections from the moment they are accepted.

Their number is limited before their TLS handshake, not after it. Anyone who can reach the port can open connections and
send nothing, without a token. They must not take the descriptors that a capture needs, so a new connection closes the
one that has been silent longest once the limit is reached.
"""

from __future__ import annotations

import asyncio
import socket
import ssl
from collections.abc import Callable
from contextlib import suppress
from itertools import chain

from station.console.http.protocol import ConsoleProtocol, Phase

RETRY_S = 0.1  # until the next attempt to accept, without a free descriptor
TLS_CLOSE_S = 3.0  # for a client to confirm the end of its connection: it holds a descriptor meanwhile


class Connections:
    """Acceptor of connections, up to a limit.

    limit: connections at the same time, those in their handshake included.
    make: a protocol for one connection.
    tls: the server's certificate, None for plain HTTP.
    """

    def __init__(self, make: Callable[[], ConsoleProtocol], limit: int, tls: ssl.SSLContext | None = None) -> None:
        self._make, self._limit, self._tls = make, limit, tls
        self._phases: dict[Phase, dict[ConsoleProtocol, None]] = {phase: {} for phase in Phase}
        self._handshakes: dict[ConsoleProtocol, asyncio.Task[None]] = {}

    @property
    def count(self) -> int:
        """Number of connections."""
        return sum(map(len, self._phases.values()))

    async def accept(self, listener: socket.socket) -> None:
        """Accept connections until cancelled. listener: bound, not blocking."""
        loop = asyncio.get_running_loop()
        while True:
            try:
                line, _ = await loop.sock_accept(listener)
            except OSError:
                self._close_silent()
                await asyncio.sleep(RETRY_S)
                continue
            if self.count < self._limit or self._close_silent():
                self._begin(line)
            else:
                line.close()
            await asyncio.sleep(0)  # what was closed gives its descriptor back now

    def end(self) -> None:
        """Give up the connections in their handshake: the others are the server's to end."""
        for task in list(self._handshakes.values()):
            task.cancel()

    def _begin(self, line: socket.socket) -> None:
        connection = self._make()
        connection.on_phase = self._move
        self._move(connection, Phase.SILENT)
        self._handshakes[connection] = asyncio.create_task(self._shake_hands(connection, line))

    async def _shake_hands(self, connection: ConsoleProtocol, line: socket.socket) -> None:
        tls = {"ssl_handshake_timeout": connection.head_s, "ssl_shutdown_timeout": TLS_CLOSE_S} if self._tls else {}
        is_made = False
        try:
            with suppress(OSError):  # refused, given up or late: the client sees it
                # Head and body of an answer are two writes: Nagle's algorithm would hold the second for 40 ms.
                line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                await asyncio.get_running_loop().connect_accepted_socket(lambda: connection, line, ssl=self._tls, **tls)
                is_made = True
        finally:
            del self._handshakes[connection]
            if not is_made:
                line.close()
                self._move(connection, None)

    def _move(self, connection: ConsoleProtocol, phase: Phase | None) -> None:
        for group in self._phases.values():
            group.pop(connection, None)
        if phase is not None:
            self._phases[phase][connection] = None

    def _close_silent(self) -> bool:
        """Close the connection that has been silent longest, else the one idle longest.

        Returns False when all are busy.
        """
        found = next(chain(self._phases[Phase.SILENT], self._phases[Phase.IDLE]), None)
        if found is None:
            return False
        self._move(found, None)
        if (handshake := self._handshakes.get(found)) is not None:
            handshake.cancel()
        if found.transport is not None:
            found.transport.abort()
        return True

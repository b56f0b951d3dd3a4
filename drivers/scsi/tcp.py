"""Transport to a simulated device in another process, over a socket."""

from __future__ import annotations

import errno
import os
import socket
import time
from contextlib import suppress

from drivers.scanner import TransportError
from drivers.scsi.checks import check_command, with_sense
from drivers.scsi.framing import MAX_DATA, PREFIX, Request, build_request, frame_length, parse_reply
from drivers.scsi.transport import DEFAULT_TIMEOUT_S, Reply

HINT = "start the simulated device: python -m drivers.simulated CONFIG"


class TcpDevice:
    """Device that listens at an address.

    When a command is aborted, by an error or by its caller, its answer may still arrive and would be mistaken for the
    next one's: the next command therefore uses a new connection.
    Raises TransportError when nothing listens.
    """

    def __init__(self, host: str, port: int, *, timeout: float = DEFAULT_TIMEOUT_S) -> None:
        self.max_transfer = MAX_DATA
        self._address, self._open = (host, port), True
        self._socket: socket.socket | None = None
        self._connected(timeout)

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command; see Transport."""
        check_command(self, cdb, data_out, data_in_length, timeout)
        if not self._open:
            raise TransportError("the connection to the simulated device is closed", "connect again")
        whole = False
        try:
            until = time.monotonic() + timeout
            end = self._connected(timeout)
            end.sendall(build_request(Request(cdb, data_out, data_in_length)))
            body = receive(end, frame_length(receive(end, PREFIX.size, until=until)), until=until)
            whole = True
        except OSError as error:
            raise TransportError(f"the simulated device does not answer: {error.strerror or error}", HINT) from error
        finally:
            if not whole:
                self._hang_up()
        reply = parse_reply(body)
        return with_sense(self, cdb, Reply(reply.status, reply.data[:data_in_length], reply.sense), timeout)

    def close(self) -> None:
        """Close the connection. Safe to call twice."""
        self._open = False
        self._hang_up()

    def _connected(self, timeout: float) -> socket.socket:
        if self._socket is None:
            try:
                self._socket = socket.create_connection(self._address, timeout)
            except OSError as error:
                where = ":".join(map(str, self._address))
                raise TransportError(f"no server listens at {where}: {error.strerror or error}", HINT) from error
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(timeout)
        return self._socket

    def _hang_up(self) -> None:
        end, self._socket = self._socket, None
        if end is not None:
            with suppress(OSError):
                end.close()


def receive(end: socket.socket, length: int, *, until: float | None = None) -> bytes:
    """Receive exactly `length` bytes from a socket.

    until: time of the monotonic clock by which all must have come, however slowly they arrive.
    Raises TransportError when the stream ends before, OSError when it fails.
    """
    data = bytearray()
    while len(data) < length:
        if until is not None:
            left = until - time.monotonic()
            if left <= 0:
                raise TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT))
            end.settimeout(left)
        part = end.recv(length - len(data))
        if not part:
            raise TransportError("the other end of the connection has gone", HINT)
        data += part
    return bytes(data)

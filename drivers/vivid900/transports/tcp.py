"""A simulated device in another process, over a socket."""

from __future__ import annotations

import socket
from contextlib import suppress

from drivers.scanner import TransportError
from drivers.vivid900.transports import DEFAULT_TIMEOUT_S, Reply
from drivers.vivid900.transports.command import check_command, with_sense
from drivers.vivid900.transports.framing import (
    MAX_DATA,
    PREFIX,
    Request,
    build_request,
    frame_length,
    parse_reply,
)

HINT = "start the simulated device: python -m drivers.simulated CONFIG"


class TcpDevice:
    """The device that listens at an address. Raises TransportError when nobody does.

    After a fault of the way the connection is of no use any more: an answer that comes late would be another
    command's. Every later command raises TransportError.
    """

    def __init__(self, host: str, port: int, *, timeout: float = DEFAULT_TIMEOUT_S) -> None:
        self.max_transfer = MAX_DATA
        try:
            self._socket: socket.socket | None = socket.create_connection((host, port), timeout)
        except OSError as error:
            raise TransportError(f"nobody listens at {host}:{port}: {error.strerror or error}", HINT) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command; see Transport."""
        check_command(self, cdb, data_out, data_in_length, timeout)
        if self._socket is None:
            raise TransportError("the connection to the simulated device is closed", "connect again")
        whole = False
        try:
            self._socket.settimeout(timeout)
            self._socket.sendall(build_request(Request(cdb, data_out, data_in_length)))
            body = receive(self._socket, frame_length(receive(self._socket, PREFIX.size)))
            whole = True
        except OSError as error:
            raise TransportError(f"the simulated device does not answer: {error.strerror or error}", HINT) from error
        finally:
            if not whole:
                self.close()
        reply = parse_reply(body)
        return with_sense(self, cdb, Reply(reply.status, reply.data[:data_in_length], reply.sense), timeout)

    def close(self) -> None:
        """Let the device go. Safe to call twice."""
        end, self._socket = self._socket, None
        if end is not None:
            with suppress(OSError):
                end.close()


def receive(end: socket.socket, length: int) -> bytes:
    """Exactly so many bytes from a socket. Raises TransportError when it ends before, OSError when it fails."""
    data = bytearray()
    while len(data) < length:
        part = end.recv(length - len(data))
        if not part:
            raise TransportError("the other end of the connection has gone", HINT)
        data += part
    return bytes(data)

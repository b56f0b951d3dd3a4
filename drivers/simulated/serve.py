"""Serves a simulated device on a socket, so that driver and device are two processes."""

from __future__ import annotations

import socket
from contextlib import suppress

from drivers.scanner import TransportError
from drivers.scsi.framing import PREFIX, build_reply, frame_length, parse_request
from drivers.scsi.tcp import receive
from drivers.scsi.transport import Reply, Target

LOCALHOST = "127.0.0.1"  # not reachable from other machines


def listen(port: int = 0) -> socket.socket:
    """Return a listening socket for drivers.

    Port 0 takes any free one. Raises OSError when the port is taken.
    """
    return socket.create_server((LOCALHOST, port))


def serve(target: Target, listener: socket.socket) -> None:
    """Answer one driver after the other for as long as the listener is open.

    The device outlives its drivers, as a real one does.
    """
    while True:
        try:
            end, _ = listener.accept()
        except OSError:  # closed
            return
        with end, suppress(OSError, TransportError):  # the driver disconnected; wait for the next
            _converse(target, end)


def _converse(target: Target, end: socket.socket) -> None:
    while True:
        request = parse_request(receive(end, frame_length(receive(end, PREFIX.size))))
        answer: Reply | TransportError
        try:
            answer = target.execute(request.cdb, request.data_out, request.data_in_length)
        except TransportError as error:
            answer = error
        end.sendall(build_reply(answer))

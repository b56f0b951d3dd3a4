"""Frames of commands and answers on a byte stream, without I/O.

They are the protocol to a simulated device in another process.

A frame is its length (big-endian, 4 bytes, itself not counted) and then:
    command  data_in_length (4), length of the CDB (1), CDB, data out
    answer   status (1), length of the sense data (1), sense data, data in
A status of BROKEN means that the device's connection failed; the data are the message in UTF-8.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.scanner import TransportError
from drivers.scsi.checks import MAX_CDB_LENGTH
from drivers.scsi.transport import Reply

PREFIX = struct.Struct(">I")
_COMMAND, _ANSWER = struct.Struct(">IB"), struct.Struct(">BB")
BROKEN = 0xFF  # no SCSI status
MAX_DATA = 1 << 20  # bytes that one command may carry
MAX_FRAME = MAX_DATA + _COMMAND.size + 255


@dataclass(frozen=True)
class Request:
    """A command to the device."""

    cdb: bytes
    data_out: bytes = b""
    data_in_length: int = 0


def frame_length(prefix: bytes) -> int:
    """Number of bytes after the prefix. Raises TransportError above the largest frame."""
    (length,) = PREFIX.unpack(prefix)
    if length > MAX_FRAME:
        raise TransportError(f"a frame of {length} bytes was announced, {MAX_FRAME} are the most")
    return int(length)


def build_request(request: Request) -> bytes:
    """The frame of a command."""
    return _framed(_COMMAND.pack(request.data_in_length, len(request.cdb)) + request.cdb + request.data_out)


def parse_request(body: bytes) -> Request:
    """Read a command from the body of a frame. Raises TransportError for any other bytes."""
    if len(body) < _COMMAND.size:
        raise TransportError(f"a frame of {len(body)} bytes is not a command")
    length, size = _COMMAND.unpack_from(body)
    rest = body[_COMMAND.size :]
    if not 1 <= size <= min(MAX_CDB_LENGTH, len(rest)) or length > MAX_DATA:
        raise TransportError(f"no command has {size} bytes and asks for {length}")
    return Request(rest[:size], rest[size:], length)


def build_reply(reply: Reply | TransportError) -> bytes:
    """The frame of an answer, or of the error in its place."""
    if isinstance(reply, TransportError):
        reply = Reply(BROKEN, str(reply).encode())
    return _framed(_ANSWER.pack(reply.status, len(reply.sense)) + reply.sense + reply.data)


def parse_reply(body: bytes) -> Reply:
    """Parse an answer from the body of a frame.

    Raises TransportError for any other bytes, and for a BROKEN answer.
    """
    if len(body) < _ANSWER.size:
        raise TransportError(f"a frame of {len(body)} bytes is not an answer")
    status, size = _ANSWER.unpack_from(body)
    rest = body[_ANSWER.size :]
    if size > len(rest):
        raise TransportError(f"sense data of {size} bytes was announced in a frame of {len(body)}")
    if status == BROKEN:
        raise TransportError(rest[size:].decode("utf-8", "replace"), "look at the simulated device")
    return Reply(status, rest[size:], rest[:size])


def _framed(body: bytes) -> bytes:
    return PREFIX.pack(len(body)) + body

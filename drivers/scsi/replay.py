"""Recording of a device's conversation to a file, and its replay without the device.

The file is JSON lines. The first is a Head, every other an Exchange: a command and its answer in the order in which
they happened, all bytes in base64 (RFC 4648 §5). A recording that was cut off is valid up to its last whole line.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable
from pathlib import Path
from typing import IO, Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drivers.scanner import TransportError
from drivers.scsi.checks import check_command
from drivers.scsi.transport import DEFAULT_TIMEOUT_S, Reply, Transport
from restore.files import read_regular

Line = TypeVar("Line", bound=BaseModel)
log = logging.getLogger(__name__)
MAX_BYTES = 2**28  # a capture with its picture is 10 MB
HINT = "record it again, or replay what was recorded"

_Model = ConfigDict(
    frozen=True, extra="forbid", populate_by_name=True, ser_json_bytes="base64", val_json_bytes="base64"
)


class Head(BaseModel):
    """First line: format, version, and the recorded transport's max_transfer."""

    model_config = _Model
    format: Literal["planish-scsi-recording"] = "planish-scsi-recording"
    version: Literal[1] = 1
    max_transfer: Annotated[int, Field(gt=0)]


class Exchange(BaseModel):
    """Command and its answer: status, data, sense data, or the failure.

    out  data to the device; asked ("in" in the file)  bytes requested from the device.
    """

    model_config = _Model
    cdb: bytes
    out: bytes = b""
    asked: Annotated[int, Field(ge=0, alias="in")] = 0
    status: Annotated[int, Field(ge=0, le=0xFF)] | None = None
    data: bytes = b""
    sense: bytes = b""
    failure: str | None = None
    hint: str = ""

    @model_validator(mode="after")
    def _has_one_end(self) -> Self:
        if (self.status is None) == (self.failure is None):
            raise ValueError("an exchange ends with a status or with a failure")
        if len(self.data) > self.asked:
            raise ValueError(f"{len(self.data)} bytes of data where {self.asked} were asked for")
        return self


class Recorder:
    """Forwards every command to another transport and records it with its answer.

    file  opened for writing text; it is not closed here. When it cannot be written, a full disk for example, the
          recording ends there with a warning in the log, and the commands go on: switching the laser off comes first.
    """

    def __init__(self, transport: Transport, file: IO[str]) -> None:
        self.max_transfer = transport.max_transfer
        self._transport, self._file = transport, file
        self._ended = False
        self._write(Head(max_transfer=self.max_transfer).model_dump_json())

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Send one command; see Transport. A command that no bus can carry is not recorded."""
        try:
            reply = self._transport.execute(cdb, data_out, data_in_length, timeout)
        except TransportError as error:
            self._note(cdb=cdb, out=data_out, asked=data_in_length, failure=str(error), hint=error.hint)
            raise
        self._note(cdb=cdb, out=data_out, asked=data_in_length, status=reply.status, data=reply.data, sense=reply.sense)
        return reply

    def close(self) -> None:
        """Close the recorded transport. Safe to call twice."""
        self._transport.close()

    def _note(self, **fields: Any) -> None:
        if self._ended:
            return
        try:
            self._write(Exchange(**fields).model_dump_json(by_alias=True, exclude_defaults=True))
        except (OSError, ValueError) as error:  # ValueError: the file was closed, or the exchange is not valid
            self._ended = True
            log.warning("the recording ends here, the capture goes on: %s", error)

    def _write(self, line: str) -> None:
        self._file.write(line + "\n")
        self._file.flush()  # a crash loses no recorded exchange


class Replay:
    """Device that answers as recorded, to the same commands in the same order.

    name  of the recording, for messages.
    Raises TransportError for a recording that is damaged.
    """

    def __init__(self, lines: Iterable[str], *, name: str = "the recording") -> None:
        head, *exchanges = list(lines) or [""]
        self.max_transfer = _parsed(Head, head, f"{name}, line 1").max_transfer
        self._name, self._place, self._closed = name, 0, False
        self._exchanges = [
            _parsed(Exchange, line, f"{name}, line {number}") for number, line in enumerate(exchanges, start=2)
        ]

    def execute(
        self, cdb: bytes, data_out: bytes = b"", data_in_length: int = 0, timeout: float = DEFAULT_TIMEOUT_S
    ) -> Reply:
        """Answer one command; see Transport.

        Raises TransportError for another command than the recorded one.
        """
        check_command(self, cdb, data_out, data_in_length, timeout)
        recorded = self._upcoming()
        if (recorded.cdb, recorded.out, recorded.asked) != (cdb, data_out, data_in_length):
            message = f"{self._name} has {recorded.cdb.hex(' ')} as command {self._place}, it was asked {cdb.hex(' ')}"
            raise TransportError(message, HINT)
        self._place += 1
        if recorded.status is None:
            raise TransportError(recorded.failure or "", recorded.hint)
        return Reply(recorded.status, recorded.data, recorded.sense)

    def close(self) -> None:
        """End the replay. Safe to call twice."""
        self._closed = True

    def _upcoming(self) -> Exchange:
        if self._closed:
            raise TransportError(f"{self._name} is closed", "connect to the scanner again")
        if self._place == len(self._exchanges):
            raise TransportError(f"{self._name} ends after {self._place} commands", HINT)
        return self._exchanges[self._place]


def load_replay(path: Path) -> Replay:
    """Open a recording. Raises TransportError when it cannot be read or is damaged."""
    try:
        *lines, cut_off = read_regular(path, MAX_BYTES).decode("utf-8").split("\n")  # a whole line ends in a line feed
        if not lines and cut_off:
            lines = [cut_off]
        return Replay(lines, name=str(path))
    except OSError as error:
        raise TransportError(f"cannot read {path}: {error.strerror}", "check the path") from error
    except UnicodeDecodeError as error:
        raise TransportError(f"{path} is not a recording: {error.reason}", HINT) from error


def _parsed(kind: type[Line], text: str, where: str) -> Line:
    try:
        return kind.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        raise TransportError(f"{where}: {first['msg']}", HINT) from error

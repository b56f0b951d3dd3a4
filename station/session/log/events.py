"""Events of a session.

What one record holds, its line of JSON, the name of its folder.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError

from station.session.log.facts import VALUES, Captured, Created, Parameters
from station.session.log.results import QualityCheck, Restored
from station.session.terms.parts import RESTORE, VERDICT

RECORD = "event.json"
FORMAT = 2
VOLUME = 0  # the page number of events that concern the whole volume
MAX_RECORD_BYTES = 2**20  # settings, provenance and results of one step: a page or two of text

Kind = Literal["session", "capture", "stage", "decision", "move"]

FOLDER = re.compile(r"(?P<page>\d{4})-(?P<number>\d{6})-(?P<name>[a-z][a-z_]{0,30})")
SLOT = re.compile(r"(?P<name>[a-z][a-z_]{0,30})(?:@(?P<on>[1-9]\d{0,5}))?")
MAX_PAGE, MAX_NUMBER = 9999, 999_999  # the digits of a folder's name


class EventDamaged(ValueError):
    """A line is not a record as `encode` writes it."""


@dataclass(frozen=True)
class Input:
    """Event that a stage read: its number, and the SHA-512 of its record."""

    event: int
    sha512: str


@dataclass(frozen=True)
class Event:
    """One immutable entry of a session.

    number    counts from 1, without gaps, over the whole session.
    page      running number of the page from 1; VOLUME for what concerns the whole volume.
    kind      session, capture, stage, decision or move.
    slot      the pointer that the event sets: `capture`, `restore@5` (the restoration of the scan of event 5), `label`.
    parent    the event that the pointer named before; None for the first of its slot.
    time      ISO 8601, UTC.
    software  name and version of the program that wrote the event.
    facts     JSON values: the parameters of a stage, what a decision decides, where a scan came from.
    inputs    the events that a stage read.
    files     path in the event's folder → SHA-512, of every file but the record.
    """

    __pydantic_config__ = ConfigDict(extra="forbid", strict=True)

    number: int
    page: int
    kind: Kind
    slot: str
    parent: int | None
    time: str
    software: str
    facts: Mapping[str, Any] = field(default_factory=dict)
    inputs: tuple[Input, ...] = ()
    files: Mapping[str, str] = field(default_factory=dict)
    format: int = FORMAT

    @property
    def name(self) -> str:
        """The name of the slot: what kind of step the event is."""
        return self.slot.partition("@")[0]

    @property
    def on(self) -> int | None:
        """The event whose result this one continues; None for a slot of the page itself."""
        return int(number) if (number := self.slot.partition("@")[2]) else None

    def __getstate__(self) -> dict[str, Any]:
        """Its fields, and no facts that were read: they are read again where they are wanted."""
        return {one.name: getattr(self, one.name) for one in fields(self)}

    def check(self) -> None:
        """Read its facts. Raises ValidationError for those that no program writes."""
        if self.kind == "session":
            Created.model_validate(dict(self.facts))
        elif self.kind == "capture":
            _ = self.captured
        elif self.restored is not None or self.checked is not None:
            Parameters.model_validate(dict(self.facts))
        _ = self.value

    @cached_property
    def captured(self) -> Captured:
        """The facts of a capture."""
        return Captured.model_validate(dict(self.facts))

    @property
    def parameters(self) -> Mapping[str, Any]:
        """What a stage depends on in addition to its inputs."""
        found: Mapping[str, Any] = self.facts.get("parameters", {})
        return found

    @property
    def result(self) -> Any:
        """What a stage found, as it was recorded."""
        return self.facts.get("result")

    @cached_property
    def restored(self) -> Restored | None:
        """What a restoration found; None for other events."""
        return Restored.model_validate(self.result) if (self.kind, self.name) == ("stage", RESTORE) else None

    @cached_property
    def checked(self) -> QualityCheck | None:
        """What a quality check found; None for other events."""
        return QualityCheck.model_validate(self.result) if (self.kind, self.name) == ("stage", VERDICT) else None

    @cached_property
    def value(self) -> Any:
        """What a decision decides, as a value of `Decisions`; None for other events and decisions."""
        reader = VALUES.get(self.name) if self.kind == "decision" else None
        return None if reader is None else reader.validate_python(self.facts.get("value"), strict=True)

    @property
    def folder(self) -> str:
        """The name of the event's folder below `data`."""
        return f"{self.page:04d}-{self.number:06d}-{'move' if self.kind == 'move' else self.name}"

    @property
    def line(self) -> bytes:
        """The record as it stands in `event.json` and in the session's log."""
        return encode(self)

    @property
    def sha512(self) -> str:
        """SHA-512 of the record."""
        return hashlib.sha512(self.line).hexdigest()


_ADAPTER = TypeAdapter(Event)


def slot_of(name: str, on: Event | None = None) -> str:
    """The slot of a step, of the page itself or on the result of another event.

    >>> slot_of("label")
    'label'
    """
    return name if on is None else f"{name}@{on.number}"


def encode(event: Event) -> bytes:
    """One line of JSON, its keys in alphabetical order: equal events have equal lines.

    Raises ValueError for facts that JSON cannot represent, and for a record above MAX_RECORD_BYTES.
    """
    text = json.dumps(asdict(event), sort_keys=True, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    line = text.encode() + b"\n"
    if len(line) > MAX_RECORD_BYTES:
        raise ValueError(f"the record of an event has {len(line)} bytes, more than {MAX_RECORD_BYTES}")
    return line


def decode(line: bytes) -> Event:
    """The event of a line. Raises EventDamaged unless it is exactly what `encode` writes."""
    try:
        event: Event = _ADAPTER.validate_json(line)
        same = encode(event) == line
    except (ValidationError, ValueError, RecursionError, TypeError) as error:
        raise EventDamaged(f"it is not a record of an event: {str(error).splitlines()[0]}") from error
    if not same:
        raise EventDamaged("it is not written as a record is")
    problem = _problem(event)
    if problem:
        raise EventDamaged(problem)
    return event


def _problem(event: Event) -> str:
    """Why an event cannot be; empty when it can."""
    if event.format != FORMAT:
        return f"it has the format {event.format}; this program reads {FORMAT}"
    if not (0 < event.number <= MAX_NUMBER and VOLUME <= event.page <= MAX_PAGE):
        return "its number or its page is out of range"
    if not SLOT.fullmatch(event.slot):
        return f"{event.slot!r} is not a slot"
    earlier = [event.parent, event.on, *(one.event for one in event.inputs)]
    if any(number is not None and not 0 < number < event.number for number in earlier):
        return "it refers to an event that is not before it"
    return ""

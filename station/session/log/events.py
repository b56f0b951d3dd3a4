"""Events of a session.

What one record holds, its line of JSON, the name of its folder.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError

from station.session.log.results import RESULTS, Restored, Result
from station.session.terms.parts import PAGE, STEM

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
    """Event that a stage read.

    Its number, and the SHA-512 of its record, which lists those of its files.
    """

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

    @cached_property
    def result(self) -> Result | None:
        """What its stage found; None for other events.

        Raises ValidationError for facts that no program writes.
        """
        model = RESULTS.get(self.name) if self.kind == "stage" else None
        return None if model is None else model.model_validate(self.facts.get("result"))

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


def file_of(event: Event, part: str, ending: str = ".png") -> str | None:
    """The name of a file of a part in a restoration; None where it has none.

    ending: what follows the stem, as `-coverage.png`.
    """
    split = isinstance(event.result, Restored) and event.result.is_split
    name = STEM + (f"-{part}" if split and part != PAGE else "") + ending
    return name if name in event.files else None


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

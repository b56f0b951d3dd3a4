"""What the facts of an event may be.

They are checked once when a session is read; the code that shows, checks, exports or restores a page takes them as they
are. A session may be damaged, or of another origin.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from pathlib import PurePosixPath
from typing import Annotated, Any

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from station.session.log.events import VOLUME, Event
from station.session.log.history import CAPTURE, History
from station.session.log.results import RESULTS, Facts, Number
from station.session.terms.about import ABOUT, ABOUT_TABLE
from station.session.terms.labels import LABELS, LEAF_ORDER, MISSING_LEAVES, RUNS
from station.session.terms.presets import Preset, changed_preset
from station.session.terms.rules import EDITS, RULES, RULES_TABLE, RecordedEdits
from station.session.terms.volume import Volume, volume_of_facts

SESSION = "session"
SETTINGS = "settings"  # the decision on the volume that changes settings of its preset
OWN_SLOTS = {SESSION, CAPTURE}  # of one kind of event each


def _inside(name: str) -> str:
    """A path that stays in its folder. Raises ValueError for another one."""
    path = PurePosixPath(name)
    if not name or "\0" in name or path.is_absolute() or ".." in path.parts:
        raise ValueError("it leads out of the folder of its event")
    return name


class Created(Facts):
    """Facts of the first event."""

    id: str
    volume: dict[str, Any]


class Captured(Facts):
    """Facts of a capture. scan: its path among its files."""

    scan: Annotated[str, AfterValidator(_inside)]
    unit: str = "auto"
    grid: str = "auto"
    depth: str = "auto"
    scale: str | None = None
    provenance: dict[str, Any] = Field(default_factory=dict)


class Stage(Facts):
    """Facts of a stage."""

    parameters: dict[str, Any] = Field(default_factory=dict)


VALUES: Mapping[str, TypeAdapter[Any]] = {
    **{name: TypeAdapter(str) for name in ("label", "label_left", "label_right", "side", "note")},
    **{name: TypeAdapter(bool) for name in ("mark", "accept")},
    "position": TypeAdapter(Number),
    SETTINGS: TypeAdapter(dict[str, dict[str, Any]]),
    EDITS: TypeAdapter(RecordedEdits | None),
    RULES: RULES_TABLE,
    **{name: TypeAdapter(bool) for name in ("left_out", "left_out_left", "left_out_right")},
    "order": LEAF_ORDER,
    "missing": MISSING_LEAVES,
    LABELS: RUNS,
    ABOUT: ABOUT_TABLE,
}


def check_facts(history: History) -> None:
    """Raise ValueError for events whose facts no program of ours writes; names the event."""
    preset: Preset | None = None
    for event in history.events:
        try:
            _check_place(event, history)
            if event.kind == SESSION:
                preset = Preset.model_validate(_volume(event).preset_values)
            elif event.kind == "capture":
                Captured.model_validate(dict(event.facts))
            elif event.kind == "stage" and event.name in RESULTS:
                Stage.model_validate(dict(event.facts))
                _ = event.result
            elif event.kind == "decision" and event.name in VALUES:
                value = VALUES[event.name].validate_python(event.facts.get("value"), strict=True)
                if event.name == SETTINGS and preset is not None:
                    changed_preset(preset, value)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"])) or "its facts"
            raise ValueError(f"event {event.number}, {event.name}: {where}: {first['msg']}") from error
        except ValueError as error:
            raise ValueError(f"event {event.number}, {event.name}: {error}") from error


def _volume(event: Event) -> Volume:
    Created.model_validate(dict(event.facts))
    return volume_of_facts(event.facts)


def _check_place(event: Event, history: History) -> None:
    """Raise ValueError for a place that an event of its kind cannot have.

    A slot, a page or a time.
    """
    datetime.fromisoformat(event.time)
    if (event.kind == SESSION) != (event.number == 1):
        raise ValueError("a session begins with one event of its own, and has it once")
    for kind in OWN_SLOTS:
        if (event.kind == kind and event.slot != kind) or (event.name == kind and event.kind not in (kind, "move")):
            raise ValueError(f"a {event.kind} is recorded as {event.slot}")
    if event.kind == "capture" and event.page == VOLUME:
        raise ValueError("a scan is of no page")
    if event.kind == "stage" and (event.on is None or history.event(event.on).page != event.page):
        raise ValueError("a stage continues no event of its page")
    for name in event.files:
        _inside(name)

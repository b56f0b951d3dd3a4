"""Checks that the events of a session can be: their places, and their facts.

They are checked once when a session is read; the code that shows, checks, exports or restores a page takes them as they
are. A session may be damaged, or of another origin.
"""

from __future__ import annotations

from datetime import datetime

from pydantic import ValidationError

from station.session.log.events import VOLUME, Event
from station.session.log.facts import SETTINGS, inside
from station.session.log.history import CAPTURE, History
from station.session.terms.presets import Preset, changed_preset
from station.session.terms.volume import volume_of_facts

SESSION = "session"
OWN_SLOTS = {SESSION, CAPTURE}  # of one kind of event each


def check_facts(history: History) -> None:
    """Raise ValueError for events whose facts no program of ours writes; names the event."""
    preset: Preset | None = None
    for event in history.events:
        try:
            _check_place(event, history)
            event.check()
            if event.kind == SESSION:
                preset = Preset.model_validate(volume_of_facts(event.facts).preset_values)
            elif event.kind == "decision" and event.name == SETTINGS and preset is not None:
                changed_preset(preset, event.value)
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"])) or "its facts"
            raise ValueError(f"event {event.number}, {event.name}: {where}: {first['msg']}") from error
        except ValueError as error:
            raise ValueError(f"event {event.number}, {event.name}: {error}") from error


def _check_place(event: Event, history: History) -> None:
    """Raise ValueError for a slot, page or time that an event of its kind cannot have."""
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
        inside(name)

"""What the operator's actions do: each is a task for the shift, done between two keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from station.capture_loop.loop import Shift
from station.console.rows import rows_of
from station.session import decide

SHOTS = frozenset({"shoot", "again", "insert"})
ON_A_PAGE = frozenset({"again", "insert", "accept", "mark", "note", "label", "side"})

Do = Callable[[Shift, int, str], None]
"""Does an action on a page (0 for none) with a text."""


def insert(shift: Shift, before: int) -> None:
    """Shoot a new page, and put it before another one: its order key lies between the neighbours'."""
    rows = rows_of(shift.writer.session)
    at = next((i for i, row in enumerate(rows) if row["page"] == before), None)
    if at is None:
        return
    order = rows[at]["order"]
    place = (rows[at - 1]["order"] + order) / 2 if at else order - 1.0
    events = len(shift.writer.history.events)
    shift.press("shoot")
    if len(shift.writer.history.events) > events and shift.page is not None:
        decide(shift.writer, "position", place, page=shift.page)
        shift.changed()


def set_value(shift: Shift, page: int, text: str, *, name: str) -> None:
    """Record a label or a side of a page."""
    decide(shift.writer, name, text.strip(), page=page)
    shift.changed()


DO: Mapping[str, Do] = {
    "shoot": lambda shift, _page, _text: shift.press("shoot"),
    "again": lambda shift, page, _text: shift.press("again", page=page),
    "insert": lambda shift, page, _text: insert(shift, page),
    "accept": lambda shift, page, _text: shift.press("accept", page=page),
    "mark": lambda shift, page, _text: shift.press("mark", page=page),
    "note": lambda shift, page, text: shift.note(text.strip(), page=page),
    "undo": lambda shift, _page, _text: shift.press("undo"),
    "redo": lambda shift, _page, _text: shift.press("redo"),
    "label": partial(set_value, name="label"),
    "side": partial(set_value, name="side"),
}

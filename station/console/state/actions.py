"""What the operator's actions do: each is a task for the loop, done between two keys."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from station.capture_loop.loop import CaptureLoop
from station.console.shown_pages.rows import rows_of
from station.session.operations.arrangement import keep_both
from station.session.operations.description import describe_page

SHOTS = frozenset({"capture", "again", "insert"})
ON_A_PAGE = frozenset({"again", "insert", "accept", "keep_both", "mark", "note", "reject", "side"})

Do = Callable[[CaptureLoop, int, str], object]
"""Does an action on a page (0 for none) with a text."""


def insert(loop: CaptureLoop, before: int) -> None:
    """Capture a new page, and put it before another one.

    Its order key lies between the neighbours'.
    """
    rows = rows_of(loop.writer.session)
    at = next((i for i, row in enumerate(rows) if row["page"] == before), None)
    if at is None:
        return
    order = rows[at]["order"]
    place = (rows[at - 1]["order"] + order) / 2 if at else order - 1.0
    events = len(loop.writer.history.events)
    loop.press("capture")
    if len(loop.writer.history.events) > events and loop.page is not None:
        loop.change(partial(describe_page, page=loop.page, values={"position": place}))


def set_side(loop: CaptureLoop, page: int, text: str) -> None:
    """Record the side of a page."""
    loop.change(partial(describe_page, page=page, values={"side": text.strip()}))


DO: Mapping[str, Do] = {
    "capture": lambda loop, _page, _text: loop.press("capture"),
    "again": lambda loop, page, _text: loop.press("again", page=page),
    "insert": lambda loop, page, _text: insert(loop, page),
    "accept": lambda loop, page, _text: loop.press("accept", page=page),
    "mark": lambda loop, page, _text: loop.press("mark", page=page),
    "note": lambda loop, page, text: loop.note(text.strip(), page=page),
    "undo": lambda loop, _page, _text: loop.press("undo"),
    "redo": lambda loop, _page, _text: loop.press("redo"),
    "reject": lambda loop, page, _text: loop.change(partial(describe_page, page=page, values={"accept": False})),
    "side": set_side,
    "keep_both": lambda loop, page, _text: loop.change(partial(keep_both, number=page)),
}

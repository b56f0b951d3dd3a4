"""Record corrections of one page or of many, checked against what was recorded meanwhile."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from restore import BadInput, PageEdits
from station.capture_loop.loop import CaptureLoop
from station.console.faults import ConsoleFault
from station.console.shown_pages.corrections import corrections_of, shown_page, tag_of
from station.console.state.open_session import WritableSession
from station.session import Session
from station.session.corrections.layers import own_edits, rules_of
from station.session.corrections.scope import kept_fields
from station.session.log.history import CAPTURE
from station.session.terms.rules import Rule, Scope, Table, edits_of

OF_ONE_SCAN = ("spine", "scan")  # fields that fit no other scan
HINT = "see docs/how-to/opened-books.md for the fields"


def correct_page(opened: WritableSession, number: int, edits: Table | None, tag: int) -> dict[str, Any]:
    """Record corrections of a page, and return them as they stand then.

    tag: of the corrections that these were made from. Nothing is recorded for those that the page has.
    Raises ConsoleFault for values that cannot be, and with the present corrections where the tag is another's.
    """
    given = None if edits is None else _given(edits)

    def record(loop: CaptureLoop) -> dict[str, Any]:
        session = loop.writer.session
        page = shown_page(session, number)
        if tag_of(session, page) != tag:
            text = f"page {number} was corrected or captured again meanwhile"
            raise ConsoleFault.changed(text, corrections_of(session, number))
        if (given or PageEdits()).given() != own_edits(session, page).given():
            loop.correct(number, given)
        return corrections_of(loop.writer.session, number)

    return opened.ask(record)


def plan_rule(session: Session, scope: Scope, edits: Table) -> dict[str, Any]:
    """Return the pages that a rule would be on, and which keep their own fields.

    Raises ConsoleFault for values that cannot be.
    """
    given = _for_many(edits)
    if isinstance(scope.captures, list):
        _check_scans(session, scope.captures)
    return _pages_of(session, Rule(id=len(session.history.events) + 1, scope=scope, edits=given))


def apply_rule(opened: WritableSession, scope: Scope, edits: Table) -> dict[str, Any]:
    """Record corrections of many pages as one step, and return its number and its pages.

    Raises ConsoleFault for values that cannot be.
    """
    given = _for_many(edits)

    def record(loop: CaptureLoop) -> dict[str, Any]:
        if isinstance(scope.captures, list):
            _check_scans(loop.writer.session, scope.captures)
        try:
            loop.apply(scope, given)
        except BadInput as error:  # as many rules as a volume can have
            raise ConsoleFault("invalid", str(error), error.hint) from error
        rule = rules_of(loop.writer.session)[-1]
        return {"rule": rule.id, **_pages_of(loop.writer.session, rule)}

    return opened.ask(record)


def _pages_of(session: Session, rule: Rule) -> dict[str, Any]:
    """Return the pages that a rule is on, and the fields of it that they keep."""
    pages = [one for one in session.history.pages() if one.capture and rule.is_on(session.history.shots(one.capture))]
    kept = {page.number: kept_fields(own_edits(session, page), rule.edits) for page in pages}
    return {"pages": [*kept], "own": {page: fields for page, fields in kept.items() if fields}}


def _for_many(edits: Table) -> PageEdits:
    """Return the fields of corrections of many pages. Raises ConsoleFault."""
    given = _given(edits)
    for name in _of_one_scan(given):
        raise ConsoleFault("invalid", f"{name} fits no other scan", "set it on each page", field=name)
    return given


def _given(edits: Table) -> PageEdits:
    """Return the corrections that were given. Raises ConsoleFault."""
    try:
        return edits_of(edits)
    except BadInput as error:
        raise ConsoleFault("invalid", str(error), HINT) from error


def _of_one_scan(edits: PageEdits) -> list[str]:
    """Return the names of fields that fit one scan only."""
    parts = [f"parts.{name}.outline" for name, part in edits.parts.items() if part.outline]
    return [name for name in OF_ONE_SCAN if getattr(edits, name) is not None] + parts


def _check_scans(session: Session, captures: Collection[int]) -> None:
    """Raise ConsoleFault for a number that is not of a scan."""
    events = session.history.events
    for number in captures:
        if not 0 < number <= len(events) or events[number - 1].slot != CAPTURE:
            raise ConsoleFault("invalid", f"event {number} is not a scan", "name scans of this session")

"""Routes of corrections by hand: of a page, of many pages, and the layout that was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from fastapi import APIRouter, Response

from restore import BadInput, PageEdits
from station.console.faults import ConsoleFault
from station.console.routes.answers import FAULTS, Acting, Looking, PageNumber, Tag, number_of, tagged
from station.console.routes.requests import Corrections, NewRule
from station.console.shown_pages.corrections import corrections_of, shown_page
from station.session import correct
from station.session.corrections.scope import pages_of
from station.session.operations.corrections import apply_rule, plan_rule
from station.session.terms.rules import Scope, Table, edits_of, recorded

HINT = "see docs/how-to/opened-books.md for the fields"

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/pages/{number}/edits")
def edits(app_state: Looking, number: PageNumber, response: Response) -> dict[str, Any]:
    """Return the corrections of a page, with their sources."""
    return tagged(response, corrections_of(app_state.opened().session, number))


@router.put("/pages/{number}/edits")
def change(
    app_state: Acting, number: PageNumber, wanted: Corrections, if_match: Tag, response: Response
) -> dict[str, Any]:
    """Correct a page; 412 with the present corrections where they are not those of `If-Match`."""
    opened, tag = app_state.writable(), number_of(if_match)
    given = None if wanted.edits is None else _given(wanted.edits)
    shown_page(opened.session, number)
    opened.change(lambda writer: correct(writer, number, given, expected=tag), partial(corrections_of, number=number))
    return tagged(response, corrections_of(opened.session, number))


@router.get("/pages/{number}/layout")
def layout(app_state: Looking, number: PageNumber) -> dict[str, Any]:
    """Return where the spine of a page is, and whether it is one.

    The first answer takes seconds.
    """
    session = app_state.opened().session
    page = shown_page(session, number)
    return {"page": number, "capture": page.capture.number, **app_state.layouts.of(session, page.capture)}


@router.post("/rules", status_code=201)
def add_rule(app_state: Acting, wanted: NewRule) -> dict[str, Any]:
    """Correct many pages in one step."""
    opened, edits, scope = app_state.writable(), _given(wanted.edits), Scope(**wanted.scope.model_dump())
    event = opened.change(lambda writer: apply_rule(writer, plan_rule(writer.session, scope, edits)))
    assert event is not None
    return {"rule": event.number, **_shown(pages_of(opened.session, event.value[-1]))}


@router.post("/rules/plan")
def plan(app_state: Looking, wanted: NewRule) -> dict[str, Any]:
    """Return the pages that such corrections would be on; nothing is recorded."""
    session, edits = app_state.opened().session, _given(wanted.edits)
    return _shown(plan_rule(session, Scope(**wanted.scope.model_dump()), edits).pages)


def _shown(pages: Mapping[int, Sequence[str]]) -> dict[str, Any]:
    """Return the pages of a rule, and the fields of it that they keep."""
    return {"pages": [*pages], "own": {page: fields for page, fields in pages.items() if fields}}


def _given(edits: Table) -> PageEdits:
    """Return corrections that can be recorded. Raises ConsoleFault."""
    try:
        given = edits_of(edits)
        recorded(given)
    except BadInput as error:
        raise ConsoleFault("invalid", str(error), HINT) from error
    return given

"""Routes of corrections by hand: of a page, of many pages, and the layout that was found."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from station.console.routes.answers import FAULTS, Acting, Looking, PageNumber, Tag, number_of, tagged
from station.console.routes.requests import Corrections, NewRule
from station.console.shown_pages.corrections import corrections_of, shown_page
from station.console.state.correcting import apply_rule, correct_page, plan_rule
from station.session.terms.rules import Scope

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/pages/{number}/edits")
def edits(app_state: Looking, number: PageNumber, response: Response) -> dict[str, Any]:
    """Return the corrections of a page, with their sources."""
    return tagged(response, corrections_of(app_state.opened().session, number))


@router.put("/pages/{number}/edits")
def correct(
    app_state: Acting, number: PageNumber, wanted: Corrections, if_match: Tag, response: Response
) -> dict[str, Any]:
    """Correct a page; 412 with the present corrections where they are not those of `If-Match`."""
    return tagged(response, correct_page(app_state.writable(), number, wanted.edits, number_of(if_match)))


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
    return apply_rule(app_state.writable(), Scope(**wanted.scope.model_dump()), wanted.edits)


@router.post("/rules/plan")
def plan(app_state: Looking, wanted: NewRule) -> dict[str, Any]:
    """Return the pages that such corrections would be on; nothing is recorded."""
    return plan_rule(app_state.opened().session, Scope(**wanted.scope.model_dump()), wanted.edits)

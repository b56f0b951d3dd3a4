"""Routes of words: those of a page, and a search."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query

from station.console.faults import ConsoleFault
from station.console.routes.answers import FAULTS, Looking, PageNumber, Prefix
from station.console.shown_pages.words import as_json

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/pages/{number}/words")
def words(app_state: Looking, number: PageNumber, leaf: Prefix = "") -> dict[str, Any]:
    """The words of a page and where they stand."""
    opened = app_state.opened()
    restored = opened.row(number)["restore"]
    if restored is None:
        raise ConsoleFault("no_words", "this page is not restored")
    found, _ = app_state.words.of(opened.session, opened.session.history.event(restored), leaf)
    return as_json(found)


@router.get("/search")
def search(app_state: Looking, q: Annotated[str, Query(min_length=1, max_length=200)]) -> dict[str, Any]:
    """The pages on which a phrase stands."""
    opened = app_state.opened()
    return app_state.words.search(opened.session, opened.rows(), q)

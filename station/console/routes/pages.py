"""Routes of the pages of the open session, and the operator's actions."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path
from fastapi.responses import Response

from station.console.faults import ConsoleFault
from station.console.routes.answers import FAULTS, IMMUTABLE, Acting, Looking, PageNumber
from station.console.routes.requests import Press
from station.console.shown_pages.rows import detail_of
from station.console.state.app_state import AppState
from station.console.state.preview import Preview

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/pages")
def pages(app_state: Looking) -> dict[str, Any]:
    """A row for each page, in the order of the volume."""
    opened = app_state.opened()
    rows = opened.rows()
    current = opened.page if opened.page in {row["page"] for row in rows} else None
    return {"pages": rows, "current": current}


@router.get("/pages/{number}")
def page(app_state: Looking, number: PageNumber) -> dict[str, Any]:
    """All that is known of a page."""
    opened = app_state.opened()
    return detail_of(opened.session, opened.row(number))


@router.post("/press", status_code=202)
def press(app_state: Acting, wanted: Press) -> dict[str, Any]:
    """Do what a key does; events report the outcome."""
    page = app_state.press(wanted.action, wanted.page, wanted.text)
    return {"accepted": True, "action": wanted.action, "page": page}


@router.get("/preview")
def preview(app_state: Looking) -> dict[str, Any] | None:
    """The last preview; null before the first."""
    return None if app_state.preview is None else dict(app_state.preview.facts)


@router.get("/preview/{number}.jpg", response_class=Response)
def preview_image(app_state: Looking, number: Annotated[int, Path(ge=1)]) -> Response:
    """Its picture."""
    return Response(_preview(app_state, number).image, media_type="image/jpeg", headers={"Cache-Control": IMMUTABLE})


@router.get("/preview/{number}/overlay.png", response_class=Response)
def preview_overlay(app_state: Looking, number: Annotated[int, Path(ge=1)]) -> Response:
    """What is clipped, not measured, or outside the depth window."""
    return Response(_preview(app_state, number).overlay, media_type="image/png", headers={"Cache-Control": IMMUTABLE})


def _preview(app_state: AppState, number: int) -> Preview:
    found = app_state.preview
    if found is None or number != found.facts["n"]:
        raise ConsoleFault("no_preview", "the preview does not exist", "take one")
    return found

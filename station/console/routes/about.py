"""Routes of the description of the volume: title, creators, language, rights and so on."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from station.console.routes.answers import FAULTS, Acting, Looking, Tag, number_of, tagged
from station.console.routes.requests import Described
from station.session import Session
from station.session.log.current import about_of
from station.session.operations.description import describe
from station.session.operations.tags import description_tag
from station.session.terms.about import ABOUT, about_from

router = APIRouter(prefix="/api", responses=FAULTS)


def shown_about(session: Session) -> dict[str, Any]:
    """Return the description of a volume as JSON values, with its tag."""
    return {"tag": description_tag(session), "about": about_of(session.history).given()}


@router.get("/about")
def about(app_state: Looking, response: Response) -> dict[str, Any]:
    """Return the description of the volume."""
    return tagged(response, shown_about(app_state.opened().session))


@router.put("/about")
def change(app_state: Acting, wanted: Described, if_match: Tag, response: Response) -> dict[str, Any]:
    """Replace the description of the volume; fields that are not given are not known.

    412 with the present one where `If-Match` is not its tag.
    """
    opened, tag = app_state.writable(), number_of(if_match)
    opened.change(lambda writer: describe(writer, about_from(wanted.about, ABOUT), expected=tag), shown_about)
    return tagged(response, shown_about(opened.session))

"""Routes of the description of the volume: title, creators, language, rights and so on."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from station.console.routes.answers import FAULTS, Acting, Looking, Tag, number_of, tagged
from station.console.routes.requests import Described
from station.console.state.describing import describe, shown_about

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/about")
def about(app_state: Looking, response: Response) -> dict[str, Any]:
    """Return the description of the volume."""
    return tagged(response, shown_about(app_state.opened().session))


@router.put("/about")
def change(app_state: Acting, wanted: Described, if_match: Tag, response: Response) -> dict[str, Any]:
    """Replace the description of the volume; fields that are not given are not known.

    412 with the present one where `If-Match` is not its tag.
    """
    return tagged(response, describe(app_state.writable(), wanted.about, number_of(if_match)))

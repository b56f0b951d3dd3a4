"""Routes of the contact sheet: leaf sides, their order and their labels."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from station.console.routes.answers import FAULTS, Acting, Looking, Tag, number_of, tagged
from station.console.routes.requests import ChangedLeaf, LabelRun, MissingLeaves, MovedLeaves
from station.console.shown_pages.leaves import shown_leaves
from station.console.state.arranging import change_leaf, mark_missing, move_leaves, number_from

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/leaves")
def leaves(app_state: Looking, response: Response) -> dict[str, Any]:
    """Return the leaf sides of the volume, in their order."""
    return tagged(response, shown_leaves(app_state.opened().session))


@router.post("/order")
def order(app_state: Acting, wanted: MovedLeaves, if_match: Tag, response: Response) -> dict[str, Any]:
    """Move leaf sides before another one, and return all.

    412 with the present arrangement where `If-Match` is not its tag.
    """
    opened = app_state.writable()
    move_leaves(opened, wanted.leaves, wanted.before, number_of(if_match))
    return tagged(response, shown_leaves(opened.session))


@router.put("/labels")
def labels(app_state: Acting, wanted: LabelRun, if_match: Tag, response: Response) -> dict[str, Any]:
    """Number the leaf sides from one on by a run, and return all.

    null takes the run away that begins there.
    """
    opened = app_state.writable()
    number_from(opened, wanted.leaf, wanted.run, number_of(if_match))
    return tagged(response, shown_leaves(opened.session))


@router.put("/missing")
def missing(app_state: Acting, wanted: MissingLeaves, if_match: Tag, response: Response) -> dict[str, Any]:
    """Set the labels of leaf sides that are missing before one, and return all."""
    opened = app_state.writable()
    mark_missing(opened, wanted.before, wanted.labels, number_of(if_match))
    return tagged(response, shown_leaves(opened.session))


@router.put("/leaves")
def change(app_state: Acting, wanted: ChangedLeaf, if_match: Tag, response: Response) -> dict[str, Any]:
    """Leave a leaf side out, put it back or set its label, and return all.

    412 with the present leaf side where `If-Match` is not its tag.
    """
    opened = app_state.writable()
    change_leaf(opened, wanted.leaf, number_of(if_match), left_out=wanted.left_out, label=wanted.label)
    return tagged(response, shown_leaves(opened.session))

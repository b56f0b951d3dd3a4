"""Routes of the contact sheet: leaf sides, their order and their labels."""

from __future__ import annotations

from functools import partial
from typing import Any

from fastapi import APIRouter, Response

from station.console.routes.answers import FAULTS, Acting, Looking, Tag, number_of, tagged
from station.console.routes.requests import ChangedLeaf, LabelRun, MissingLeaves, MovedLeaves
from station.console.shown_pages.leaves import reviewed_leaves, shown_leaf, shown_leaves
from station.console.state.app_state import AppState
from station.console.state.open_session import Current, Operation
from station.session.operations.arrangement import change_leaf, mark_missing, move_leaves, number_from

router = APIRouter(prefix="/api", responses=FAULTS)


@router.get("/leaves")
def leaves(app_state: Looking, response: Response) -> dict[str, Any]:
    """Return the leaf sides of the volume, in their order."""
    return tagged(response, shown_leaves(app_state.opened().session))


@router.get("/review")
def review(app_state: Looking) -> dict[str, Any]:
    """Return the delivered leaf sides, each compared with its neighbours."""
    return {"leaves": reviewed_leaves(app_state.opened().session)}


@router.post("/order")
def order(app_state: Acting, wanted: MovedLeaves, if_match: Tag, response: Response) -> dict[str, Any]:
    """Move leaf sides before another one, and return all.

    412 with the present arrangement where `If-Match` is not its tag.
    """
    move = partial(move_leaves, moved=wanted.leaves, before=wanted.before, expected=number_of(if_match))
    return _arranged(app_state, move, response)


@router.put("/labels")
def labels(app_state: Acting, wanted: LabelRun, if_match: Tag, response: Response) -> dict[str, Any]:
    """Number the leaf sides from one on by a run, and return all.

    null takes the run away that begins there.
    """
    number = partial(number_from, name=wanted.leaf, run=wanted.run, expected=number_of(if_match))
    return _arranged(app_state, number, response)


@router.put("/missing")
def missing(app_state: Acting, wanted: MissingLeaves, if_match: Tag, response: Response) -> dict[str, Any]:
    """Set the labels of leaf sides that are missing before one, and return all."""
    mark = partial(mark_missing, name=wanted.before, labels=wanted.labels, expected=number_of(if_match))
    return _arranged(app_state, mark, response)


@router.put("/leaves")
def change(app_state: Acting, wanted: ChangedLeaf, if_match: Tag, response: Response) -> dict[str, Any]:
    """Leave a leaf side out, put it back or set its label, and return all.

    412 with the present leaf side where `If-Match` is not its tag.
    """
    tag, current = number_of(if_match), partial(shown_leaf, name=wanted.leaf)
    changed = partial(change_leaf, name=wanted.leaf, left_out=wanted.left_out, label=wanted.label, expected=tag)
    return _arranged(app_state, changed, response, current)


def _arranged(
    app_state: AppState, operation: Operation, response: Response, current: Current = shown_leaves
) -> dict[str, Any]:
    """Have an operation arrange the leaf sides, and return all."""
    opened = app_state.writable()
    opened.change(operation, current)
    return tagged(response, shown_leaves(opened.session))

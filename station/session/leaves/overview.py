"""What a session holds, page by page: for people and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from station.session.leaves.leaf import Leaf, missing_labels
from station.session.leaves.views import PageView, views_of
from station.session.log.history import redo_target, undo_target
from station.session.log.store import Session

ROW = "{:>8}  {:<8} {:<6} {:<9} {:<6} {:<8} {:<6} {}"


def overview(session: Session) -> dict[str, Any]:
    """The session as JSON values: what it is of, its pages in the order of the volume."""
    return {
        "id": session.identifier,
        "folder": str(session.folder),
        **session.volume.model_dump(mode="json", exclude={"preset_values"}),
        "events": len(session.history.events),
        "pages": [_page(view) for view in views_of(session)],
    }


def overview_lines(session: Session) -> Iterator[str]:
    """The session as lines of text."""
    shown = overview(session)
    yield f"{shown['title']}  {shown['project']}".rstrip()
    yield f"{session.folder}, {len(shown['pages'])} pages, {shown['events']} events, preset {shown['preset']}"
    if shown["pages"]:
        yield ROW.format("page", "label", "side", "state", "level", "kind", "edited", "note").rstrip()
    for page in shown["pages"]:
        for part in page["parts"]:
            marked = "* " if page["mark"] else ""
            edited = "later" if page["outdated"] else "yes" if page["edited"] else ""
            state = "left out" if part.get("left_out") else page["state"]
            cells = (part["name"], part["label"], part["side"], state, part["level"], page["kind"], edited)
            yield ROW.format(*(" ".join(str(cell).split()) for cell in (*cells, marked + page["note"]))).rstrip()
    for gap in missing_labels(session):
        yield f"pages are missing {gap}"
    for name, step in (("undo", undo_target(session.history)), ("redo", redo_target(session.history))):
        if step is not None:
            yield f"{name}: {step.name} of {f'page {step.page}' if step.page else 'the volume'}"


def _page(view: PageView) -> dict[str, Any]:
    return {
        "page": view.page.number,
        "position": view.position,
        "label": view.label,
        "side": view.side,
        "state": view.page.state,
        "level": view.page.level,
        "kind": view.kind,
        "edited": view.is_edited,
        "outdated": view.outdated,
        "mark": view.mark,
        "note": view.note,
        "capture": view.page.capture.number,
        "captured": view.page.capture.time,
        "runs": {name: run.number for name, run in view.page.runs.items()},
        "parts": [_part(leaf) for leaf in view.leaves],
    }


def _part(leaf: Leaf) -> dict[str, Any]:
    left_out = {"left_out": True} if leaf.is_left_out else {}
    return {
        "part": leaf.part,
        "name": leaf.name,
        "label": leaf.label,
        "side": leaf.side,
        "level": leaf.level,
        **left_out,
    }

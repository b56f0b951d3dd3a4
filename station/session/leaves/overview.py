"""What a session holds, page by page: for people and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from station.session.corrections.layers import is_corrected
from station.session.derivation.parameters import outdated_pages
from station.session.leaves.index import level_of, state_of
from station.session.leaves.leaf import Leaf, label_of, leaves_by_page, missing_labels
from station.session.log.history import redo_target, undo_target
from station.session.log.store import Session
from station.verdict.checks import worst

ROW = "{:>8}  {:<8} {:<6} {:<9} {:<6} {:<8} {:<6} {}"


def overview(session: Session) -> dict[str, Any]:
    """The session as JSON values: what it is of, its pages in the order of the volume."""
    outdated, pages = frozenset(outdated_pages(session)), leaves_by_page(session).values()
    return {
        "id": session.identifier,
        "folder": str(session.folder),
        **session.volume.model_dump(mode="json", exclude={"preset_values"}),
        "events": len(session.history.events),
        "pages": [_page(session, parts, at, parts[0].page.number in outdated) for at, parts in enumerate(pages, 1)],
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


def _page(session: Session, parts: Sequence[Leaf], position: int, outdated: bool) -> dict[str, Any]:
    page = parts[0].page
    assert page.capture is not None
    return {
        "page": page.number,
        "position": position,
        "label": label_of(parts),
        "side": parts[0].side if len(parts) == 1 else "",
        "state": state_of(page),
        "level": level_of(page),
        "kind": parts[0].kind,
        "edited": is_corrected(session, page),
        "outdated": outdated,
        "mark": bool(page.decided("mark", False)),
        "note": str(page.decided("note", "")),
        "capture": page.capture.number,
        "captured": page.capture.time,
        "runs": {name: run.number for name, run in page.runs.items()},
        "parts": [_part(leaf) for leaf in parts],
    }


def _part(leaf: Leaf) -> dict[str, Any]:
    level = worst([check["level"] for check in leaf.checks]) if leaf.is_checked else ""
    return {"part": leaf.part, "name": leaf.name, "label": leaf.label, "side": leaf.side, "level": level} | (
        {"left_out": True} if leaf.is_left_out else {}
    )

"""The pages of a session as the strip and the page view show them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

from restore import BadInput
from station.console.faults import ConsoleFault
from station.console.shown_pages.layers import (
    file_of_layer,
    layers_of,
    leaf_layers,
    models_of,
    opened,
    prefix_of,
    stored_file,
)
from station.session import VOLUME, Event, Page, Session
from station.session.leaves.views import PageView, views_of
from station.session.terms.parts import STAGES, STEM
from station.verdict.table import MEASURES

Row = dict[str, Any]
WORDS = "-alto.xml"  # the end of the name of a file with words
SHOWN_FACTS = ("value", "to", "reason")  # of an event, in the list of events


def rows_of(session: Session, restoring: Collection[int] = ()) -> list[Row]:
    """Return a row for each page, in the order of the volume.

    restoring: numbers of the pages that are being restored.
    """
    return [_row(view, restoring) for view in views_of(session)]


def detail_of(session: Session, row: Row) -> dict[str, Any]:
    """A row with all that is known of its page, but for what stands in its files."""
    page = session.history.page(row["page"])
    restored, verdict = (page.runs.get(stage) for stage in STAGES)
    result = {} if restored is None else dict(restored.result)
    measures = dict(result.pop("measures", {}))
    measures.pop("fingerprint", None)
    found = {} if verdict is None else dict(verdict.result)
    checks = () if verdict is None or verdict.checked is None else verdict.checked.checks
    return {
        **row,
        "checks": [finding_of({"same_as": one.same_as, **one.model_dump(exclude_unset=True)}) for one in checks],
        "notes": found.get("notes", []),
        "report": {**result, "measures": measures} if restored else {},
        "page_mm": result.get("page_mm"),
        "dpi": result.get("dpi"),
        "page_px": _pixels(session, restored, f"{STEM}.png"),
        "leaves": list(_leaves(session, restored)),
        "before": _before(session, restored),
        "layers": layers_of(restored, page.capture),
        "models": models_of(restored, page.capture),
        "words": restored is not None and any(name.endswith(WORDS) for name in restored.files),
        "shots": list(_shots(session, page)),
        "events": [_event(event) for event in session.history.events if event.page == page.number],
        "files": [
            {"event": event.number, "name": name, "bytes": _size(session, event, name)}
            for event in (page.capture, *page.runs.values())
            if event is not None
            for name in event.files
        ],
    }


def finding_of(stored: dict[str, Any]) -> dict[str, Any]:
    """A finding of a verdict with its unit and the direction in which it is worse."""
    amber, red = stored["limits"]
    unit = MEASURES[stored["name"]].unit if stored["name"] in MEASURES else ""
    return {"page": None, **stored, "unit": unit, "less_is_worse": amber > red}


def _row(view: PageView, restoring: Collection[int]) -> Row:
    restored = view.restoration
    return {
        "page": view.page.number,
        "position": view.position,
        "order": view.page.order,
        "label": view.label,
        "side": view.side,
        "parts": [
            {"part": leaf.part, "name": leaf.name, "label": leaf.label, "side": leaf.side, "tag": leaf.tag}
            for leaf in view.leaves
        ],
        "kind": view.kind,
        "outdated": view.outdated,
        "state": view.page.state,
        "restored": restored is not None,
        "failed": view.failure,
        "accepted": view.is_accepted,
        "marked": view.mark,
        "note": view.note,
        "kept": list(view.page.decided.keep_both),
        "level": view.page.level,
        "asks": [{"name": one.name, "part": one.part} for one in view.questions],
        "rank": round(view.rank, 3),
        "capture": view.page.capture.number,
        "restore": None if restored is None else restored.event.number,
        "captured": view.page.capture.time,
        "busy": view.page.number in restoring,
    }


def _shots(session: Session, page: Page) -> Iterator[dict[str, Any]]:
    current = None if page.capture is None else page.capture.number
    for event in session.history.events:
        if event.page == page.number and event.kind == "capture":
            size = sum(_size(session, event, name) for name in event.files)
            yield {
                "capture": event.number,
                "time": event.time,
                "current": event.number == current,
                "size_bytes": size,
            }


def _event(event: Event) -> dict[str, Any]:
    shown = {name: event.facts[name] for name in SHOWN_FACTS if name in event.facts and event.page != VOLUME}
    return {
        "number": event.number,
        "kind": event.kind,
        "name": event.name,
        "time": event.time,
        "software": event.software,
        **shown,
    }


def _leaves(session: Session, run: Event | None) -> Iterator[dict[str, Any]]:
    """Each part of a restoration: its size, its layers, or why it could not be restored."""
    parts = run.restored.leaves if run is not None and run.restored is not None else {}
    for part, restored in parts.items():
        prefix = prefix_of(part, len(parts))
        yield {
            "part": part,
            "prefix": prefix,
            "page_mm": restored.page_mm,
            "dpi": restored.dpi,
            "page_px": _pixels(session, run, file_of_layer(f"{prefix}page")),
            "layers": [layer.removeprefix(prefix) for layer in leaf_layers(run, prefix)],
            "failed": restored.failure,
        }


def _before(session: Session, restored: Event | None) -> dict[str, Any] | None:
    """Return the latest other restoration of the scan, with its parts."""
    others = [] if restored is None else [one for one in session.history.events if one.slot == restored.slot]
    earlier = [one for one in others if one.kind == "stage" and restored and one.number != restored.number]
    if not earlier or earlier[-1].restored is None or earlier[-1].restored.error is not None:
        return None
    return {"event": earlier[-1].number, "leaves": list(_leaves(session, earlier[-1]))}


def _pixels(session: Session, restored: Event | None, name: str) -> list[int] | None:
    """Width and height of a restored page, by the name of its file."""
    if restored is None or name not in restored.files:
        return None
    try:
        with opened(stored_file(session, restored, name)) as picture:
            return list(picture.size)
    except (BadInput, ConsoleFault):  # damaged: its picture says so
        return None


def _size(session: Session, event: Event, name: str) -> int:
    try:
        return session.path(event, name).lstat().st_size
    except OSError:  # missing: planish verify reports it
        return 0

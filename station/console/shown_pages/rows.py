"""The pages of a session as the strip and the page view show them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
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
from station.console.shown_pages.leaves import leaf_tag
from station.session import VOLUME, Event, Page, Session
from station.session.derivation.parameters import outdated_pages
from station.session.derivation.restoration import PAGE
from station.session.leaves.index import level_of, state_of
from station.session.leaves.leaf import Leaf, label_of, leaves_by_page
from station.session.terms.parts import RESTORE, VERDICT, errors_of, parts_of
from station.verdict.checks import LEVELS, OPERATOR_CHECKS
from station.verdict.table import MEASURES

Row = dict[str, Any]
WORDS = "-alto.xml"  # the end of the name of a file with words
SHOWN_FACTS = ("value", "to", "reason")  # of an event, in the list of events


def rows_of(session: Session, restoring: Collection[int] = ()) -> list[Row]:
    """Return a row for each page, in the order of the volume.

    restoring: numbers of the pages that are being restored.
    """
    outdated, pages = frozenset(outdated_pages(session)), leaves_by_page(session).values()
    return [_row(parts, at, outdated, restoring) for at, parts in enumerate(pages, 1)]


def detail_of(session: Session, row: Row) -> dict[str, Any]:
    """A row with all that is known of its page, but for what stands in its files."""
    page = session.history.page(row["page"])
    restored, verdict = page.runs.get(RESTORE), page.runs.get(VERDICT)
    result = {} if restored is None else dict(restored.facts["result"])
    measures = dict(result.pop("measures", {}))
    measures.pop("fingerprint", None)
    found = {} if verdict is None else dict(verdict.facts["result"])
    return {
        **row,
        "checks": [finding_of(one) for one in found.get("checks", [])],
        "notes": found.get("notes", []),
        "report": {**result, "measures": measures} if restored else {},
        "page_mm": result.get("page_mm"),
        "dpi": result.get("dpi"),
        "page_px": _pixels(session, restored, PAGE),
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


def questions_of(page: Page) -> list[dict[str, str]]:
    """Return the checks of a page that a correction answers, each with its part.

    None of a page that was accepted as it is.
    """
    run = page.runs.get(VERDICT)
    checks = [] if run is None or page.decided("accept", False) is True else run.facts["result"]["checks"]
    asked = [one for one in checks if one["name"] in OPERATOR_CHECKS and one["level"] != "green"]
    return [{"name": one["name"], "part": one.get("part", "")} for one in asked]


def rank_of(page: Page) -> float:
    """Return how bad a page is.

    The number of its level, and how far its worst measure is past the limit, 0 to 1. A page that could not be restored
    is worst of all; one that is not checked comes before green ones.
    """
    restored, check_run = page.runs.get(RESTORE), page.runs.get(VERDICT)
    if restored is not None and any(errors_of(restored.facts["result"])):
        return float(len(LEVELS))
    if check_run is None:
        return 0.5
    result = check_run.facts["result"]
    past = max((_past(one) for one in result["checks"] if one["level"] == result["level"]), default=0.0)
    return LEVELS.index(result["level"]) + past


def _past(finding: dict[str, Any]) -> float:
    """Return the position of a finding from the amber limit on.

    A fraction of the way to the red limit and beyond, below 1.
    """
    amber, red = finding["limits"]
    way = (finding["value"] - amber) / ((red - amber) or 1.0)
    return min(max(way, 0.0) / (1.0 + max(way, 0.0)), 0.999)


def _row(parts: Sequence[Leaf], position: int, outdated: Collection[int], restoring: Collection[int]) -> Row:
    page = parts[0].page
    assert page.capture is not None
    restored = page.runs.get(RESTORE)
    failed = None if restored is None else restored.facts["result"].get("error")
    return {
        "page": page.number,
        "position": position,
        "order": _order(page),
        "label": label_of(parts),
        "side": parts[0].side if len(parts) == 1 else "",
        "parts": [
            {"part": leaf.part, "name": leaf.name, "label": leaf.label, "side": leaf.side, "tag": leaf_tag(leaf)}
            for leaf in parts
        ],
        "kind": parts[0].kind,
        "outdated": page.number in outdated,
        "state": state_of(page),
        "restored": restored is not None and failed is None,
        "failed": {"text": failed, "hint": restored.facts["result"].get("hint", "")} if restored and failed else None,
        "accepted": page.decided("accept", False) is True,
        "marked": bool(page.decided("mark", False)),
        "note": str(page.decided("note", "")),
        "level": level_of(page),
        "asks": questions_of(page),
        "rank": round(rank_of(page), 3),
        "capture": page.capture.number,
        "restore": None if restored is None or failed else restored.number,
        "captured": page.capture.time,
        "busy": page.number in restoring,
    }


def _order(page: Page) -> float:
    position = page.decided("position", page.number)
    return float(position) if isinstance(position, int | float) else float(page.number)


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


def _leaves(session: Session, restored: Event | None) -> Iterator[dict[str, Any]]:
    """Each part of a restoration: its size, its layers, or why it could not be restored."""
    parts = {} if restored is None else parts_of(restored.facts["result"])
    for part, report in parts.items():
        prefix = prefix_of(part, len(parts))
        yield {
            "part": part,
            "prefix": prefix,
            "page_mm": report.get("page_mm"),
            "dpi": report.get("dpi"),
            "page_px": _pixels(session, restored, file_of_layer(f"{prefix}page")),
            "layers": [layer.removeprefix(prefix) for layer in leaf_layers(restored, prefix)],
            "failed": {"text": report["error"], "hint": report.get("hint", "")} if "error" in report else None,
        }


def _before(session: Session, restored: Event | None) -> dict[str, Any] | None:
    """Return the latest other restoration of the scan, with its parts."""
    others = [] if restored is None else [one for one in session.history.events if one.slot == restored.slot]
    earlier = [one for one in others if one.kind == "stage" and restored and one.number != restored.number]
    if not earlier or "error" in earlier[-1].facts["result"]:
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

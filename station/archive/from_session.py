"""Makes the record of a volume from a session's current scans, derivatives and events."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from itertools import groupby
from typing import Any, Literal

from restore import BadInput, RangeScan, SurfaceMesh, load_scan
from restore.files import read_regular
from station.archive.volume import UNLABELLED, Event, Page, Role, Section, StoredFile, Volume
from station.errors import UsageError
from station.run.options import reading_of
from station.session import Event as SessionEvent
from station.session import History, Session, scan_path
from station.session import Page as SessionPage
from station.session.corrections.layers import effective_edits
from station.session.derivation.parameters import outdated_pages
from station.session.leaves.leaf import DASH, UNCOUNTED, Leaf, is_spread, leaves_of
from station.session.log.current import about_of
from station.session.log.history import CapturedPage
from station.session.terms.parts import PAGE, part_of_file
from station.session.terms.rules import EDITS, RULES

# In the vocabulary of preservation events of the Library of Congress.
KINDS = {
    "capture": "capture",
    "restore": "creation",
    "verdict": "validation",
    EDITS: "modification",
    RULES: "modification",
}
DERIVED, CHECKED = "creation", "metadata extraction"  # other stages, with files and without
UNCROPPED = "-uncropped.png"  # the master of a page that was cropped, or a part of it removed, by hand
ROLES = {
    ".png": Role.PAGE,
    "-master.png": Role.MASTER,
    UNCROPPED: Role.MASTER,
    "-alto.xml": Role.WORDS,
    ".txt": Role.TEXT,
    ".hocr": Role.HOCR,
    ".pdf": Role.PDF,
    "-warped.obj": Role.MESH,
}
MISSING = "{} before it is missing"
SIDES: Mapping[str, Literal["left", "right"]] = {"left": "left", "right": "right"}
MAX_SCAN_RECORD = 2**20
CORRECTED = "corrected since it was restored: planish batch restores it"
NO_WHOLE = "delivered as a leaf, as no whole was kept"
WHOLE_HINT = "leave out --parts, or set the layout to whole and restore again: planish session edits, planish batch"


def volume_of(session: Session, *, whole: bool = False) -> Volume:
    """Return the volume of a session, as its pointers show it now.

    whole: deliver an opened book that was restored whole, too, as one page. Raises UsageError where leaves are all that
    its openings have, OSError for a file that is missing.
    """
    pages, outdated = list(session.history.pages()), frozenset(outdated_pages(session))
    events = [event for page in pages for event in _events_of(page)]
    names = {event.number: _names(event) for event in events}
    rules = session.history.volume.decisions.get(RULES)
    first = session.history.event(1)
    delivered = list(_delivered(session, outdated, whole=whole))
    leaves = {page.capture for page, _ in delivered if NO_WHOLE in page.problem}
    if leaves and not any(page.part == PAGE and _is_split(session.history.page(page.capture)) for page, _ in delivered):
        raise UsageError("--parts whole: no opening was kept whole", WHOLE_HINT)
    return Volume(
        session.identifier,
        session.volume.title,
        tuple(page for page, _ in delivered),
        tuple(_event(event, names, session.history) for event in ([] if rules is None else [rules]) + events),
        datetime.fromisoformat(first.time),
        session.volume.project,
        session.volume.organisation,
        about_of(session.history),
        tuple(_sections(delivered)),
    )


def _delivered(session: Session, outdated: Collection[int], *, whole: bool) -> Iterator[tuple[Page, str]]:
    """Yield the pages that are delivered, each with the start of its run of labels."""
    starts, run, number = {one.start for one in session.history.volume.decided.labels}, "", 0
    done = set[int]()
    for leaf in leaves_of(session):
        run = leaf.name if leaf.name in starts else run
        if leaf.is_left_out or leaf.page.number in done:
            continue
        number += 1
        if whole and (both := _whole(session, leaf)) is not None:
            done.add(leaf.page.number)
            leaf = both
        page = _page(session, leaf, number, outdated)
        lacks_whole = whole and leaf.part != PAGE and _is_split(leaf.page)
        yield (replace(page, problem="; ".join(filter(None, (page.problem, NO_WHOLE)))) if lacks_whole else page), run


def _whole(session: Session, leaf: Leaf) -> Leaf | None:
    """Return the whole that was kept next to the leaves of an opened book, None without one."""
    run = leaf.page.restoration
    if run is None or leaf.part == PAGE or run.file(PAGE) is None or not run.result.is_split:
        return None
    leaves = [one for one in leaves_of(session) if one.page.number == leaf.page.number]
    labels = tuple(label for one in leaves for label in one.labels)
    return replace(leaf, part=PAGE, labels=labels, side="", restored=run.result.parts.get("page"))


def _is_split(page: SessionPage) -> bool:
    """Return whether a page was restored as two leaves."""
    return page.restored is not None and page.restored.is_split


def _sections(delivered: Sequence[tuple[Page, str]]) -> Iterator[Section]:
    """Yield successive pages of one run of labels, or of one kind that is not counted."""
    kinds = [(run, page.kind if page.kind in UNCOUNTED else "") for page, run in delivered]
    for (_, kind), group in groupby(zip(kinds, delivered, strict=True), key=lambda pair: pair[0]):
        pages = [page for _, (page, _) in group]
        labels = filter(None, dict.fromkeys((pages[0].label, pages[-1].label)))
        yield Section(kind or DASH.join(labels) or UNLABELLED, kind or "run", tuple(page.number for page in pages))


def scan_of(session: Session, page: Page) -> RangeScan | SurfaceMesh:
    """Return the scan of a page, in the unit that it was restored in.

    Else in that of its capture. Raises BadInput for a damaged scan, and for a page that has none.
    """
    current = session.history.captured(int(page.name.partition("/")[0]))
    assert current is not None
    captured, run = current.capture.captured, current.restoration
    if captured.is_photographed:
        raise BadInput(f"page {page.name} was photographed and has no scan", "export images: --to tiff, pdf or bagit")
    reading = captured.reading if run is None else reading_of(run.event.parameters)
    return load_scan(scan_path(session, current.capture), **reading)


def _events_of(page: CapturedPage) -> Iterator[SessionEvent]:
    """Yield the current capture of a page, its corrections, and the current runs on it."""
    yield page.capture
    if EDITS in page.decisions:
        yield page.decisions[EDITS]
    yield from sorted(page.runs.values(), key=lambda event: event.number)


def _page(session: Session, leaf: Leaf, number: int, outdated: Collection[int]) -> Page:
    page, restored = leaf.page, leaf.restored
    size = None if restored is None else restored.leaf_mm or restored.page_mm
    files = [file for event in _events_of(page) for file in _files(session, event, leaf.part)]
    edits = page.decisions.get(EDITS)
    return Page(
        number,
        leaf.label,
        tuple(files),
        SIDES.get(leaf.side, ""),
        _provenance(session, page.capture),
        leaf.name,
        "; ".join([*([CORRECTED] if page.number in outdated else []), *map(MISSING.format, leaf.missing)]),
        page.number,
        leaf.part,
        leaf.kind or ("spread" if len(leaf.labels) > 1 else ""),
        is_spread(leaf) or len(leaf.labels) > 1,
        _spine(session, leaf),
        None if size is None else (float(size[0]), float(size[1])),
        "" if edits is None else _identifier(edits),
    )


def _spine(session: Session, leaf: Leaf) -> tuple[tuple[float, float], ...]:
    """Return the spine that a leaf was cut at, px of the image; empty for a page."""
    if leaf.part == PAGE:
        return ()
    layout = (leaf.restored.layout.model_extra if leaf.restored and leaf.restored.layout else None) or {}
    found = layout.get("spine") if layout.get("frame") == "picture" else None
    drawn = (effective_edits(session, leaf.page) or {}).get("spine") or found or ()
    return tuple((float(x), float(y)) for x, y in drawn)


def _files(session: Session, event: SessionEvent, part: str) -> Iterator[StoredFile]:
    """The files of an event that are of a part of its page, or of the whole."""
    several = event.restored is not None and event.restored.is_split
    for (path, digest), name in zip(event.files.items(), _names(event), strict=True):
        of, ending = part_of_file(path)
        if several and of not in (part, PAGE):
            continue
        where = session.path(event, path)
        other = several and of == PAGE != part  # the whole, kept next to its leaves
        other |= ending == "-master.png" and path.removesuffix(ending) + UNCROPPED in event.files
        role = Role.ORIGINAL if event.kind == "capture" else Role.OTHER if other else ROLES.get(ending, Role.OTHER)
        yield StoredFile(where, name, role, digest, where.stat().st_size, _identifier(event))


def _names(event: SessionEvent) -> tuple[str, ...]:
    """Return the names of an event's files in an export.

    Scans of several captures of a page never have the same names.
    """
    folder = f"pages/{event.page:04}" + ("" if event.kind == "capture" else f"/{event.name}")
    return tuple(f"{folder}/{path}" for path in event.files)


def _event(event: SessionEvent, names: dict[int, tuple[str, ...]], history: History) -> Event:
    sources = [name for one in event.inputs for name in names.get(one.event, _names(history.event(one.event)))]
    kind = KINDS.get(event.name, DERIVED if event.files else CHECKED)
    facts = {name: value for name, value in event.facts.items() if name != "parameters"}
    parameters = event.parameters
    if event.name in (EDITS, RULES):
        parameters = {event.name: facts.pop("value", None)}
    return Event(
        _identifier(event),
        kind,
        datetime.fromisoformat(event.time),
        event.software,
        f"{event.name}, " + (f"page {event.page}" if event.page else "volume"),
        tuple(sources),
        _names(event),
        parameters,
        facts,
        _operator(event),
    )


def _operator(event: SessionEvent) -> str:
    """Return who made corrections or the latest rule; empty for other events."""
    value = event.value
    edits = value[-1].edits if event.name == RULES and value else value if event.name == EDITS else None
    return "" if edits is None else str(edits.by.operator)


def _identifier(event: SessionEvent) -> str:
    return f"{event.number:06}"


def _provenance(session: Session, capture: SessionEvent) -> dict[str, Any]:
    """Return what a capture's scan folder says of it, or what was stored with other formats."""
    path = next((name for name in capture.files if name.endswith("/scan.json")), None)
    stored: dict[str, Any] = {"time": capture.time}
    if path is None:
        return stored
    with suppress(OSError, ValueError, KeyError):
        found = json.loads(read_regular(session.path(capture, path), MAX_SCAN_RECORD))["provenance"]
        return {**stored, **found} if isinstance(found, dict) else stored
    return stored

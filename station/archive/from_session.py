"""Makes the record of a volume from a session.

Current scans, their current derivatives, and the events that made both.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from datetime import datetime
from typing import Any, Literal

from restore import BadInput, RangeScan, SurfaceMesh, load_scan
from restore.files import read_regular
from station.archive.volume import Event, Page, Role, StoredFile, Volume
from station.session import Event as SessionEvent
from station.session import History, Session, scan_path
from station.session import Page as SessionPage
from station.session.corrections import outdated_pages
from station.session.leaves import Leaf, delivered_leaves
from station.session.parts import PAGE, RESTORE, part_of_file, parts_of
from station.session.photographs import is_set

# In the vocabulary of preservation events of the Library of Congress.
KINDS = {"capture": "capture", "restore": "creation", "verdict": "validation"}
DERIVED, CHECKED = "creation", "metadata extraction"  # other stages, with files and without
ROLES = {
    ".png": Role.PAGE,
    "-master.png": Role.MASTER,
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


def volume_of(session: Session) -> Volume:
    """Return the volume of a session, as its pointers show it now.

    Raises OSError for a file that is missing.
    """
    pages, outdated = list(session.history.pages()), frozenset(outdated_pages(session))
    events = [event for page in pages for event in _events_of(page)]
    names = {event.number: _names(event) for event in events}
    first = session.history.event(1)
    return Volume(
        session.identifier,
        session.volume.title,
        tuple(_page(session, leaf, outdated) for leaf in delivered_leaves(session)),
        tuple(_event(event, names, session.history) for event in events),
        datetime.fromisoformat(first.time),
        session.volume.project,
        session.volume.organisation,
    )


def scan_of(session: Session, page: Page) -> RangeScan | SurfaceMesh:
    """Return the scan of a page, in the unit that it was restored in.

    Else in that of its capture. Raises BadInput for a damaged scan, and for a page that has none.
    """
    current = session.history.page(int(page.name.partition("/")[0]))
    assert current.capture is not None
    if is_set(current.capture.facts):
        raise BadInput(f"page {page.name} was photographed and has no scan", "export images: --to tiff, pdf or bagit")
    run = current.runs.get(RESTORE)
    reading = current.capture.facts if run is None else run.facts.get("parameters", {})
    return load_scan(scan_path(session, current.capture), unit=str(reading.get("unit", "auto")))


def _events_of(page: SessionPage) -> Iterator[SessionEvent]:
    """The current capture of a page, and the current runs on it in their order."""
    if page.capture is not None:
        yield page.capture
    yield from sorted(page.runs.values(), key=lambda event: event.number)


def _page(session: Session, leaf: Leaf, outdated: Collection[int]) -> Page:
    files = [file for event in _events_of(leaf.page) for file in _files(session, event, leaf.part)]
    return Page(
        leaf.position,
        leaf.label or str(leaf.position),
        tuple(files),
        SIDES.get(leaf.side, ""),
        _provenance(session, leaf.page.capture),
        leaf.name,
        "; ".join([*([CORRECTED] if leaf.page.number in outdated else []), *map(MISSING.format, leaf.missing)]),
    )


def _files(session: Session, event: SessionEvent, part: str) -> Iterator[StoredFile]:
    """The files of an event that are of a part of its page, or of the whole."""
    several = event.name == RESTORE and len(parts_of(event.facts["result"])) > 1
    for (path, digest), name in zip(event.files.items(), _names(event), strict=True):
        of, ending = part_of_file(path)
        if several and of not in (part, PAGE):
            continue
        where = session.path(event, path)
        whole = several and of == PAGE  # the whole, kept next to its leaves
        role = Role.ORIGINAL if event.kind == "capture" else Role.OTHER if whole else ROLES.get(ending, Role.OTHER)
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
    return Event(
        _identifier(event),
        kind,
        datetime.fromisoformat(event.time),
        event.software,
        f"{event.name}, page {event.page}",
        tuple(sources),
        _names(event),
        event.facts.get("parameters", {}),
        facts,
    )


def _identifier(event: SessionEvent) -> str:
    return f"{event.number:06}"


def _provenance(session: Session, capture: SessionEvent | None) -> dict[str, Any]:
    """Return what the scan folder of a capture says of it.

    For scans of other formats, when they were stored.
    """
    path = None if capture is None else next((name for name in capture.files if name.endswith("/scan.json")), None)
    if capture is None:
        return {}
    stored: dict[str, Any] = {"time": capture.time}
    if path is None:
        return stored
    with suppress(OSError, ValueError, KeyError):
        found = json.loads(read_regular(session.path(capture, path), MAX_SCAN_RECORD))["provenance"]
        return {**stored, **found} if isinstance(found, dict) else stored
    return stored

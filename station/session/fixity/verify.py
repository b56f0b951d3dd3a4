"""`verify`: compares every file of a session with its events.

It names the page that is damaged.
"""

from __future__ import annotations

import fcntl
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from restore import BadInput
from station.errors import FolderInUse, StationError
from station.session.fixity.reconcile import ReconciledEvents, reconcile
from station.session.fixity.tree import place_of, tree_digests
from station.session.log import bag
from station.session.log.events import FOLDER, RECORD, VOLUME, Event
from station.session.log.history import folded
from station.session.log.reading import complete_is_possible
from station.storage.folder_lock import HOLDER_BYTES, LOCK, WORK

Kind = Literal["damaged", "missing", "extra", "renamed", "contradiction", "unfinished"]


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with a session.

    page: the page that is damaged; VOLUME for others.
    path: of the file, relative to the session.
    remedy: how the file can be had again; empty when only a copy of the session has it.
    moved_to: where a renamed file is now.
    """

    kind: Kind
    page: int
    path: str
    remedy: str
    moved_to: str = ""

    @property
    def text(self) -> str:
        """The problem in a line."""
        moved = f", it is now {self.moved_to}" if self.moved_to else ""
        remedy = self.remedy or "it cannot be derived again: take it from a copy with planish repair --from"
        return f"{place_of(self.page)}: {self.path} is {WORDS[self.kind]}{moved}; {remedy}"


WORDS = {
    "damaged": "not the file that was written",
    "missing": "missing",
    "extra": "no part of the session",
    "renamed": "renamed",
    "contradiction": "at odds with the other records",
    "unfinished": "not finished: its writer was interrupted",
}
FROM_RECORDS = "planish repair writes it from the other records"
DERIVED = "planish repair derives it again"
PUT_BACK = "planish repair puts it back"
SET_ASIDE = "planish repair sets it aside"
COPIED = "planish repair copies it from an equal file of the session"
COMPLETED = "the next command that writes to the session completes it"


@dataclass(frozen=True)
class Inspection:
    """A session as it is: its files' digests, what its events say, and the problems found."""

    found: Mapping[str, str]
    reconciled: ReconciledEvents
    problems: tuple[Problem, ...]


def verify(folder: Path, *, workers: int | None = None) -> Inspection:
    """Compare every file with what the events say; write nothing.

    workers: threads that compute digests; one for each processor by default.
    Raises BadInput when the folder is not a session, FolderInUse while a writer is at work, OSError.
    """
    if not (folder / bag.PAYLOAD).is_dir():
        raise BadInput(f"{folder} is not a session: it has no folder {bag.PAYLOAD}", "check the path")
    refuse_live_writer(folder)
    found = tree_digests(folder, without=WORK, workers=workers)
    reconciled = reconcile(folder, list(found))
    problems = list(_compare(found, reconciled))
    problems += _broken_references(reconciled)
    if problems and complete_is_possible(folder):
        problems = _without_interruption(problems, reconciled)
    return Inspection(found, reconciled, tuple(problems))


def refuse_live_writer(folder: Path) -> None:
    """Raise FolderInUse while a writer has the session; the lock is only looked at."""
    with suppress(FileNotFoundError, NotADirectoryError), (folder / WORK / LOCK).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderInUse(folder, file.read(HOLDER_BYTES).decode("utf-8", "replace")) from None


def page_of(path: str) -> int:
    """Return the page that a path of a session belongs to.

    From its folder's name; VOLUME for others.
    """
    parts = path.split("/")
    match = FOLDER.fullmatch(parts[1]) if len(parts) > 1 and parts[0] == bag.PAYLOAD else None
    return int(match["page"]) if match else VOLUME


def _compare(found: Mapping[str, str], reconciled: ReconciledEvents) -> Iterator[Problem]:
    expected = reconciled.expected()
    missing = [path for path in expected if path not in found]
    extra = [
        path for path in found if path not in expected and not (path in bag.TAG_FILES and not reconciled.is_complete)
    ]
    for path, digest in expected.items():
        if path in found and found[path] != digest:
            yield Problem("damaged", page_of(path), path, _remedy(path, expected, found, reconciled))
    for path in missing:
        place = next((other for other in extra if found[other] == expected[path]), "")
        if place:
            extra.remove(place)
            yield Problem("renamed", page_of(path), path, PUT_BACK, place)
        else:
            yield Problem("missing", page_of(path), path, _remedy(path, expected, found, reconciled))
    yield from (Problem("extra", page_of(path), path, SET_ASIDE) for path in extra)


def _remedy(path: str, expected: Mapping[str, str], found: Mapping[str, str], reconciled: ReconciledEvents) -> str:
    """How a file can be had again; empty when it cannot."""
    if path in bag.TAG_FILES or path.endswith(f"/{RECORD}"):
        return FROM_RECORDS
    if expected[path] in found.values():
        return COPIED
    event = reconciled.events[int(path.split("/")[1].split("-")[1])]
    return DERIVED if event.kind == "stage" and _is_derivable(event, expected, found, reconciled) else ""


def _is_derivable(
    event: Event, expected: Mapping[str, str], found: Mapping[str, str], reconciled: ReconciledEvents
) -> bool:
    """Return whether all inputs of an event are whole or derivable."""
    for one in event.inputs:
        source = reconciled.events.get(one.event)
        if source is None or source.sha512 != one.sha512:
            return False
        inside = f"{bag.PAYLOAD}/{source.folder}"
        whole = all(found.get(f"{inside}/{name}") == digest for name, digest in source.files.items())
        if not whole and not (source.kind == "stage" and _is_derivable(source, expected, found, reconciled)):
            return False
    return True


def _broken_references(reconciled: ReconciledEvents) -> Iterator[Problem]:
    """Yield events with missing inputs, scans, pointers, or gaps in their numbers."""
    for name in reconciled.disputed:
        yield Problem("contradiction", page_of(f"{bag.PAYLOAD}/{name}/"), f"{bag.PAYLOAD}/{name}/{RECORD}", "")
    if reconciled.events and not reconciled.is_complete:
        gaps = sorted(set(range(1, max(reconciled.events) + 1)) - set(reconciled.events))
        yield from (Problem("missing", VOLUME, f"event {number}", "") for number in gaps)
    for event in reconciled.events.values():
        for one in event.inputs:
            source = reconciled.events.get(one.event)
            if source is None or source.sha512 != one.sha512:
                yield Problem("contradiction", event.page, f"{bag.PAYLOAD}/{event.folder}/{RECORD}", "")
    if reconciled.is_complete:
        try:
            folded(reconciled.events[number] for number in sorted(reconciled.events))
        except ValueError:
            yield Problem("contradiction", VOLUME, bag.LOG, "")


def _without_interruption(problems: list[Problem], reconciled: ReconciledEvents) -> list[Problem]:
    """The problems, those of an unfinished last event as one."""
    last = reconciled.events[max(reconciled.events)]
    others = [problem for problem in problems if problem.path not in (bag.LOG, bag.MANIFEST, bag.TAG_MANIFEST)]
    return [*others, Problem("unfinished", last.page, f"{bag.PAYLOAD}/{last.folder}", COMPLETED)]


class NotSound(StationError):
    """Raised when a session that was checked is not as its events say."""

    exit_code = 6

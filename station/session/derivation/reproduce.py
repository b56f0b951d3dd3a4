"""`reproduce`: derives everything again from a session's originals; compares digests."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from restore import BadInput
from station.page_files.report import finite
from station.session.captures.scans import scan_path
from station.session.derivation.quality import fingerprints_of, run_verdict
from station.session.derivation.restoration import Run, run_restore
from station.session.log.events import FORMAT, Event
from station.session.log.store import Session, file_digests
from station.session.terms.parts import RESTORE, VERDICT
from station.version import software_version

ABSENT = object()  # equal to no value that JSON has

Derive = Callable[[Session, Event, Path], Run]


@dataclass(frozen=True)
class Reproduced:
    """A run of a stage that was derived again.

    differing  names of its files that came out otherwise, are missing or new, and `result.KEY` for keys of its result.
    """

    event: Event
    differing: tuple[str, ...]

    @property
    def reason(self) -> str:
        """Return why it may differ.

        The program that wrote the record, and this one; empty when it is the same.
        """
        now = software_version()
        if (self.event.format, self.event.software) == (FORMAT, now):
            return ""
        return f"recorded by {self.event.software}, record format {self.event.format}; this is {now}, format {FORMAT}"


def reproduce(session: Session, scratch: Path, *, derivers: Mapping[str, Derive] | None = None) -> Iterator[Reproduced]:
    """Derive every run of a stage again, and compare in the order of the session.

    Writes only below `scratch`. Raises BadInput for a stage that this program does not know, what the stages raise,
    OSError.
    """
    for event in session.history.events:
        if event.kind == "stage":
            folder = scratch / event.folder
            try:
                run = derive(session, event, folder, derivers=derivers)
                yield Reproduced(event, tuple(_differences(event, run, folder)))
            finally:
                shutil.rmtree(folder, ignore_errors=True)


def derive(session: Session, event: Event, folder: Path, *, derivers: Mapping[str, Derive] | None = None) -> Run:
    """Run the stage of an event again, into a new folder, with its parameters on its inputs.

    Raises BadInput for a stage that this program does not know, and what the stage raises.
    """
    known = DERIVERS if derivers is None else derivers
    if event.name not in known:
        raise BadInput(f"{event.folder}: this program has no stage {event.name!r}", f"use {event.software}")
    folder.mkdir(parents=True)
    return known[event.name](session, event, folder)


def _differences(event: Event, run: Run, folder: Path) -> Iterator[str]:
    files = file_digests(folder)
    yield from sorted(name for name in {*files, *event.files} if files.get(name) != event.files.get(name))
    made, recorded = finite(run.result), finite(event.result)
    keys = sorted({*made, *recorded})
    yield from (f"result.{key}" for key in keys if made.get(key, ABSENT) != recorded.get(key, ABSENT))


def _restore(session: Session, event: Event, folder: Path) -> Run:
    capture = session.history.event(event.inputs[0].event)
    return run_restore(scan_path(session, capture), event.parameters, folder)


def _verdict(session: Session, event: Event, _folder: Path) -> Run:
    on, *others = (session.history.event(one.event) for one in event.inputs)
    return run_verdict(on.result, event.parameters, fingerprints_of(others))


DERIVERS: Mapping[str, Derive] = {RESTORE: _restore, VERDICT: _verdict}

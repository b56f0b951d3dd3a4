"""One scan restored once, or quarantined once with the reason.

The records of earlier runs decide what is still to do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal, Protocol

from restore.runtime import LibraryMissing
from station.errors import StationError
from station.intake import records
from station.intake.arrival import OF_A_NAME, Arrival, Unreadable
from station.run.attempts import Failure, OnDisk, attempted
from station.run.edits import edits_of
from station.run.one_page import Destination, Outcome
from station.run.options import AUTO, RunOptions

RANGE_IMAGES = (".abs", ".abs.gz")
OF_THE_COMPUTER = (OSError, StationError, LibraryMissing)  # faults of the disk, the results or this computer
UNREADABLE = "unreadable"  # in place of the digest of a file that may not be read

Now = Callable[[], datetime]


def is_range_image(source: Path) -> bool:
    """Return whether a scan is always in millimetres: a scan folder or an `.abs` file."""
    return source.is_dir() or source.name.lower().endswith(RANGE_IMAGES)


class Restore(Protocol):
    """Restores a scan file; see `station.run.one_page.restore_file`."""

    def __call__(
        self, source: Path, destination: Destination, options: RunOptions, *, facts: Mapping[str, Any], stem: str | None
    ) -> Outcome: ...


@dataclass(frozen=True)
class Settled:
    """What became of a scan.

    state   restored or set aside now; done: in an earlier run, either of the two.
    place   the folder of its results, or the note of the failure.
    reason  why it was set aside, one line.
    """

    state: Literal["done", "restored", "set aside"]
    place: Path
    reason: str = ""


def restore_once(
    arrival: Arrival,
    out: Path,
    options: RunOptions,
    staged: Path,
    restore: Restore,
    *,
    now: Now = records.utc,
    causes: Sequence[str] = (),
    memory_is_shared: bool = False,
) -> Settled:
    """Copy a scan to the empty folder `staged` and restore the copy, or quarantine the scan.

    causes: how earlier processes that restored it ended, where that is known.
    memory_is_shared: the process has a part of the memory, so that MemoryError is raised, which is not the scan's
    fault.
    Raises Changed, OSError and other faults that are not the scan's.
    """
    try:
        return _restored_once(arrival, out, options, staged, restore, now, causes, memory_is_shared)
    except (PermissionError, Unreadable) as error:
        reasons = [f"cannot read {error.filename}: {error.strerror}"]
    except OSError as error:
        if error.errno not in OF_A_NAME:
            raise
        reasons = [f"its name cannot be used here: {error.strerror} ({error.filename})"]
    records.end_attempt(out, arrival)
    return _set_aside(arrival, out, UNREADABLE, reasons, now())


def _restored_once(
    arrival: Arrival, out: Path, options: RunOptions, staged: Path, restore: Restore, now: Now, causes: Sequence[str],
    memory_is_shared: bool,
) -> Settled:  # fmt: skip
    digest = arrival.copy(staged)
    if known := records.find_result(out, arrival, digest):
        records.end_attempt(out, arrival)
        return Settled("done", known)
    if records.failed_digest(out, arrival) == digest:
        return Settled("done", records.note_of(out, arrival))
    original = arrival.folder / arrival.source
    facts = {"scan": str(original), "arrival": arrival.as_data(digest)}
    if is_range_image(original):
        options = replace(options, unit=AUTO)
    stem = None if arrival.stem == arrival.own_stem else arrival.stem

    def restored() -> Path:
        folder, scan = records.free_folder(out, arrival), staged / arrival.source.name
        corrected = replace(options, edits=edits_of(scan, None))
        restore(scan, Destination(folder), corrected, facts=facts, stem=stem)
        return folder

    attempts = OnDisk(
        lambda: records.begin_attempt(out, arrival, digest), lambda: records.end_attempt(out, arrival), causes
    )
    fatal = (*OF_THE_COMPUTER, *((MemoryError,) if memory_is_shared else ()))
    made = attempted(restored, attempts, fatal=fatal)
    if isinstance(made, Failure):
        lines = [line.replace(str(staged), str(original.parent)) for line in (made.text, *made.hints)]
        return _set_aside(arrival, out, digest, lines, now())
    records.forget_failure(out, arrival)
    return Settled("restored", made)


def _set_aside(arrival: Arrival, out: Path, digest: str, reasons: Sequence[str], now: datetime) -> Settled:
    note = records.note_of(out, arrival)
    if records.failed_digest(out, arrival) == digest:
        return Settled("done", note)
    records.set_aside(out, arrival, digest, reasons, now)
    records.end_attempt(out, arrival)
    return Settled("set aside", note, reasons[0])

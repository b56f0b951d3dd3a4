"""Plans a batch: the scans that have neither a result nor a failure; longest first."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from station.batch.page import Task
from station.intake import records
from station.intake.arrival import BLOCK, Arrival
from station.intake.companions import Pairing, adjacent_path, is_scan
from station.intake.kept import Kept
from station.intake.listing import Listing, list_files
from station.intake.presets import Presets
from station.run.options import RunOptions

SCAN_FOLDER = {"scan.json", "points.npz"}  # the files that every scan folder of Planish's own has


@dataclass(frozen=True)
class Plan:
    """The scans of a folder.

    out       folder of the results.
    tasks     what is still to do, longest first.
    scans     every scan, in the order of their names.
    sessions  those below the folder, which are left out.
    """

    out: Path
    tasks: tuple[Task, ...]
    scans: tuple[Arrival, ...]
    sessions: tuple[Path, ...] = ()


def plan_folder(folder: Path, out: Path, base: RunOptions) -> Plan:
    """The plan for a folder of scans and its sub-folders.

    Raises OSError when the folder cannot be read, UsageError for a preset with a mistake.
    """
    sessions: list[Path] = []
    listing = list_files(folder, without=out, left_out=lambda session: sessions.append(folder / session))
    presets = Presets(folder, base)
    presets.update(listing)
    kept = Kept.load(out)
    scans = tuple(find_scans(folder, listing, kept))
    tasks = []
    groups: dict[tuple[str, str], list[Arrival]] = {}
    for scan in scans:
        groups.setdefault((adjacent_path(scan.source, ""), scan.stem), []).append(scan)
    for place, group in sorted(groups.items()):
        waiting = tuple(scan for scan in group if not _is_settled(scan, out, kept))
        if waiting:  # scans of one name have the same folders of results: one task takes them in turn
            tasks.append(Task(waiting, out, presets.options(Path(place[0]))))
    kept.save(out)
    return Plan(out, tuple(sorted(tasks, key=lambda task: -task.size)), scans, tuple(sessions))


def find_scans(folder: Path, listing: Listing, kept: Kept | None = None) -> Iterator[Arrival]:
    """Yield every scan of a listing with the files that belong to it.

    Scan files, and scan folders in Planish's own format.
    kept: of an earlier start.
    """
    pairing = Pairing(folder, kept)
    pairing.update(listing)
    names: dict[str, set[str]] = {}
    for path in listing:
        place, _, name = str(path).rpartition("/")
        names.setdefault(place, set()).add(name)
    inside = {Path(place) for place, files in names.items() if place and files >= SCAN_FOLDER}
    sources = [path for path in listing if is_scan(path) and (not inside or path.parent not in inside)]
    for source in sorted([*sources, *inside]):
        if source in inside:
            files = {path: listing[path] for path in (source / name for name in sorted(names[str(source)]))}
            yield Arrival.of_folder(folder, source, files)
        else:
            try:
                companions = pairing.companions(source).found
            except OSError:  # the restoration meets it again, and sets the scan aside
                companions = {}
            yield Arrival.of(folder, source, companions, listing)


def _is_settled(arrival: Arrival, out: Path, kept: Kept) -> bool:
    """Whether the scan has a result, or was set aside and has not changed since."""
    source = str(arrival.source)
    if kept.is_settled(source, arrival.stamps, out):
        return True
    if folder := records.find_result(out, arrival):
        kept.settle(source, arrival.stamps, records.reports_of(folder, arrival)[0], out)
        return True
    failed = records.failed_digest(out, arrival)
    if failed is None or failed != _digest(arrival):
        return False
    kept.settle(source, arrival.stamps, records.note_of(out, arrival), out)
    return True


def _digest(arrival: Arrival) -> str:
    """The digest that `Arrival.copy` would return, empty for files that cannot be read."""
    digest = hashlib.sha256()
    try:
        for (name, path), stamp in zip(arrival.files.items(), arrival.stamps, strict=True):
            digest.update(os.fsencode(name) + b"\0" + stamp.size.to_bytes(8, "big"))
            with (arrival.folder / path).open("rb") as file:
                while block := file.read(BLOCK):
                    digest.update(block)
    except OSError:
        return ""
    return digest.hexdigest()


def check_names(folders: Sequence[Path]) -> bool:
    """Return whether the names of the folders differ.

    The results of each can then be stored below that name.
    """
    return len({folder.name for folder in folders}) == len(folders)

"""Reconciles the content of a session from three copies of each event.

They are its record, the log and the manifest. A single fault leaves two of them in agreement. Files are then compared
with what the events say, byte for byte.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from restore.files import read_regular
from station.session.log import bag
from station.session.log.events import FOLDER, MAX_RECORD_BYTES, RECORD, Event, EventDamaged, decode
from station.session.log.reading import MAX_TAG_FILE_BYTES


@dataclass(frozen=True)
class ReconciledEvents:
    """The events of a session on which its copies agree, and what they contradict.

    events    number → event that two copies agree on, or the only one that is whole.
    disputed  folders of events of which no record is whole.
    """

    events: Mapping[int, Event]
    disputed: tuple[str, ...]

    @property
    def is_complete(self) -> bool:
        """Whether the events count from 1 without a gap."""
        return bool(self.events) and not self.disputed and set(self.events) == set(range(1, len(self.events) + 1))

    def expected(self) -> dict[str, str]:
        """Path in the session → SHA-512, of every file that should be there."""
        ordered = [self.events[number] for number in sorted(self.events)]
        payload = {}
        for event in ordered:
            inside = f"{bag.PAYLOAD}/{event.folder}"
            payload[f"{inside}/{RECORD}"] = event.sha512
            payload |= {f"{inside}/{name}": digest for name, digest in event.files.items()}
        tags = {name: bag.sha512(data) for name, data in self.tag_files().items()}
        return tags | payload

    def tag_files(self) -> dict[str, bytes]:
        """The tag files as the events say they are; empty while events are missing."""
        return bag.tag_files([self.events[n] for n in sorted(self.events)]) if self.is_complete else {}


def reconcile(folder: Path, paths: Iterable[str]) -> ReconciledEvents:
    """Return the events of a session, whichever of the copies is damaged.

    A file that cannot be read counts as a missing copy, and raises nothing.
    paths: the files that exist.
    """
    logged = _events(_read(folder / bag.LOG, MAX_TAG_FILE_BYTES).splitlines(keepends=True))
    listed = _listed_records(_read(folder / bag.MANIFEST, MAX_TAG_FILE_BYTES))
    names = {path.split("/")[1] for path in paths if path.startswith(f"{bag.PAYLOAD}/") and path.count("/") > 1}
    names |= set(listed) | {event.folder for event in logged.values()}
    recorded = _events(_read(folder / bag.PAYLOAD / name / RECORD, MAX_RECORD_BYTES) for name in sorted(names))
    events, disputed = dict[int, Event](), []
    for name in sorted(names):
        match = FOLDER.fullmatch(name)
        if match is None:
            continue
        number = int(match["number"])
        said = [event for event in (recorded.get(number), logged.get(number)) if event and event.folder == name]
        event = _agreed(said, listed.get(name))
        if event is not None:
            events[number] = event
        elif name in listed:
            disputed.append(name)
    return ReconciledEvents(events, tuple(disputed))


def _agreed(said: Sequence[Event], listed: str | None) -> Event | None:
    """Return the event that two of record, log and manifest agree on, or the only record."""
    for event in said:
        if event.sha512 == listed:
            return event
    return said[0] if said and all(event.line == said[0].line for event in said) else None


def _events(lines: Iterable[bytes]) -> dict[int, Event]:
    """The events of the lines that are whole."""
    found = dict[int, Event]()
    for line in lines:
        try:
            event = decode(line)
        except EventDamaged:
            continue
        found[event.number] = event
    return found


def _listed_records(manifest: bytes) -> dict[str, str]:
    """Folder of each event → SHA-512 of its record, as the manifest has it."""
    found = {}
    for line in manifest.decode("utf-8", "replace").splitlines():
        digest, _, path = line.partition("  ")
        parts = path.split("/")
        if len(parts) == 3 and parts[0] == bag.PAYLOAD and parts[2] == RECORD:
            found[parts[1]] = digest
    return found


def _read(path: Path, limit: int) -> bytes:
    try:
        return read_regular(path, limit)
    except (OSError, ValueError):
        return b""

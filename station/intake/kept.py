"""Keeps what planning has found, with the results.

The next start looks at what has changed, and at nothing else. Nothing depends on the file: without it, or when it is
damaged, everything is looked at again.
"""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from pydantic import BaseModel

from restore.files import read_regular
from station.intake.listing import Stamp
from station.storage.disk import write_file

NAME = ".planish-plan"
MAX_BYTES = 2**29  # a million scans
Stamps = tuple[tuple[int, int], ...]


class _File(BaseModel):
    contents: dict[str, tuple[tuple[int, int], tuple[str, ...], bool]] = {}
    settled: dict[str, tuple[Stamps, str, tuple[int, int]]] = {}


@dataclass
class Kept:
    """What was found of each file.

    Paths are relative to the folder of scans, or to that of the results.
    contents: file → its stamp, the names of others in it, whether it has its colours inside.
    settled: scan → the stamps of its files, and its record with the stamp of that: a report or a note.
    """

    contents: dict[str, tuple[tuple[int, int], tuple[str, ...], bool]] = field(default_factory=dict)
    settled: dict[str, tuple[Stamps, str, tuple[int, int]]] = field(default_factory=dict)
    changed: bool = False

    @classmethod
    def load(cls, out: Path) -> Kept:
        """What was kept of a folder of results; nothing where it cannot be read."""
        try:
            found = _File.model_validate_json(read_regular(out / NAME, MAX_BYTES))
        except (OSError, ValueError):
            return cls()
        return cls(found.contents, found.settled)

    def save(self, out: Path) -> None:
        """Keep it for the next start.

        Where something was found and the folder of results exists.
        """
        if not self.changed or not out.is_dir():
            return
        data = json.dumps({"contents": self.contents, "settled": self.settled}, separators=(",", ":")).encode()
        with suppress(OSError):  # a full disk: it is found again
            write_file(out / f"{NAME}.part", data)
            (out / f"{NAME}.part").replace(out / NAME)

    def is_settled(self, source: str, stamps: Stamps, out: Path) -> bool:
        """Whether a scan was settled as it is, and its record is as it was then."""
        known = self.settled.get(source)
        if known is None or known[0] != stamps:
            return False
        try:
            return Stamp.of((out / known[1]).stat()) == known[2]
        except OSError:
            return False

    def settle(self, source: str, stamps: Stamps, record: Path, out: Path) -> None:
        """Note that a scan is settled, with the report or the note that says so."""
        with suppress(OSError, ValueError):
            self.settled[source] = stamps, str(record.relative_to(out)), Stamp.of(record.stat())
            self.changed = True

"""Keeps what planning has found, with the results.

The next start looks at what has changed, and at nothing else. Nothing depends on the file: without it, or when it is
damaged, everything is looked at again.
"""

from __future__ import annotations

import json
from collections.abc import Container
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from restore.files import read_regular
from station.intake.listing import Stamp
from station.storage.disk import write_file

NAME = ".planish-plan"
MAX_BYTES = 2**29  # a million scans
Stamps = tuple[tuple[int, int], ...]


@dataclass
class Kept:
    """What was found of each file.

    Paths are relative to the folder of scans, or to that of the results. An entry is one text of lines, which is parsed
    when it is asked for: lists of a hundred thousand take seconds.
    contents: file → its stamp; 1 where it has its colours inside, else 0; the names of others in it.
    settled: scan → the stamps of its files; the stamp of its record, a report or a note; the path of that.
    """

    contents: dict[str, str] = field(default_factory=dict)
    settled: dict[str, str] = field(default_factory=dict)
    changed: bool = False

    @classmethod
    def load(cls, out: Path) -> Kept:
        """What was kept of a folder of results; nothing where it cannot be read."""
        try:
            found = json.loads(read_regular(out / NAME, MAX_BYTES))
            return cls(dict(found["contents"]), dict(found["settled"]))
        except (OSError, ValueError, TypeError, KeyError, RecursionError):
            return cls()

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

    def content(self, name: str, stamp: Stamp) -> tuple[tuple[str, ...], bool] | None:
        """Return the names in a file, and whether it has colours inside, None once changed."""
        known, coloured, *names = str(self.contents.get(name, "")).split("\n") + [""]
        return (tuple(names[:-1]), coloured == "1") if known == _text(stamp) else None

    def keep(self, name: str, stamp: Stamp, names: tuple[str, ...], coloured: bool) -> None:
        """Note what was found in a file."""
        self.contents[name] = "\n".join([_text(stamp), f"{coloured:d}", *names])
        self.changed = True

    def forget_others(self, names: Container[str]) -> None:
        """Forget the files that are no longer there."""
        self.contents = {name: found for name, found in self.contents.items() if name in names}

    def is_settled(self, source: str, stamps: Stamps, out: Path) -> bool:
        """Whether a scan was settled as it is, and its record is as it was then."""
        known, record_stamp, record = (*str(self.settled.get(source, "")).split("\n", 2), "", "")[:3]
        if not record or known != _text(*stamps):
            return False
        try:
            return _text(Stamp.of((out / record).stat())) == record_stamp
        except (OSError, ValueError):
            return False

    def settle(self, source: str, stamps: Stamps, record: Path, out: Path) -> None:
        """Note that a scan is settled, with the report or the note that says so."""
        with suppress(OSError, ValueError):
            name, stamp = str(record.relative_to(out)), Stamp.of(record.stat())
            self.settled[source] = "\n".join([_text(*stamps), _text(stamp), name])
            self.changed = True


def _text(*stamps: tuple[int, int]) -> str:
    return ",".join([f"{size} {modified}" for size, modified in stamps])

"""One scan that has arrived: its files, copied to where nothing changes them, and the digest of what was copied."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from restore.formats import scan_stem
from station.intake.listing import Listing, Stamp
from station.run.one_page import SCAN_SUFFIX

BLOCK = 2**20  # bytes that are copied at a time


class Changed(Exception):
    """Raised when a file changes while it is copied."""


@dataclass(frozen=True)
class Arrival:
    """A scan with the files that belong to it.

    folder  the watched folder; source: path of the scan relative to it.
    files   name for the copy, relative to that of the scan → path relative to the watched folder; the scan is first.
            Of a scan folder, those in it.
    stamps  of the files, in their order.
    """

    folder: Path
    source: Path
    files: Mapping[str, Path]
    stamps: tuple[Stamp, ...]

    @classmethod
    def of(cls, folder: Path, source: Path, companions: Mapping[str, Path], listing: Listing) -> Arrival:
        """The arrival of a scan and its companions, as a listing has them."""
        files = {source.name: source, **companions}
        return cls(folder, source, files, tuple(listing[path] for path in files.values()))

    @classmethod
    def of_folder(cls, folder: Path, source: Path, listing: Listing) -> Arrival:
        """The arrival of a scan folder of Planish's own, as a listing has its files."""
        inside = [path for path in listing if path.is_relative_to(source)]
        files = {str(path.relative_to(source.parent)): path for path in inside}
        return cls(folder, source, files, tuple(listing[path] for path in inside))

    @property
    def stem(self) -> str:
        """First part of the names of its results."""
        if self.source.name in self.files:
            return scan_stem(self.source)
        return self.source.name.removesuffix(SCAN_SUFFIX) or self.source.name

    @property
    def size(self) -> int:
        """Bytes of all its files."""
        return sum(stamp.size for stamp in self.stamps)

    def copy(self, to: Path) -> str:
        """Copy the files to an empty folder. Returns the SHA-256 digest of names and contents, hexadecimal.

        Raises Changed when a file is not, or no longer, the one that was listed, OSError when it cannot be read or
        the disk refuses the copy.
        """
        digest = hashlib.sha256()
        for (name, path), stamp in zip(self.files.items(), self.stamps, strict=True):
            digest.update(os.fsencode(name) + b"\0" + stamp.size.to_bytes(8, "big"))
            target = to / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with (self.folder / path).open("rb") as original, target.open("xb") as copy:
                while block := original.read(BLOCK):
                    digest.update(block)
                    copy.write(block)
                if Stamp.of(os.fstat(original.fileno())) != stamp or copy.tell() != stamp.size:
                    raise Changed(path)
        return digest.hexdigest()

    def as_data(self, digest: str) -> dict[str, Any]:
        """The arrival as a field of the report: JSON values."""
        files = {
            str(path): [stamp.size, stamp.modified_ns]
            for path, stamp in zip(self.files.values(), self.stamps, strict=True)
        }
        return {"scan": str(self.source), "sha256": digest, "files": files}

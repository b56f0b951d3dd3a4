"""Scan that has arrived: a copy of its files that nothing changes, and its digest."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

from station.choices import EDITS_SUFFIX
from station.intake.companions import stem_of_name
from station.intake.listing import Listing, Stamp
from station.run.one_page import SCAN_SUFFIX

BLOCK = 2**20  # bytes that are copied at a time
MAX_NAME_BYTES = 180  # a disk takes 255: the endings of results and records, and what is put before them, are below 75
DIGITS = 12  # of the digest in place of the end of a longer name
# What a disk says of a name or of a kind of file: it is about one scan, not about the disk.
OF_A_NAME = {
    errno.ENAMETOOLONG, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ELOOP, errno.EINVAL, errno.EILSEQ,
}  # fmt: skip
# Of a network share that is not available just now.
PASSING = {errno.EIO, errno.ESTALE, errno.ETIMEDOUT, errno.EHOSTDOWN, errno.ENOTCONN, errno.ECONNRESET, errno.EAGAIN}


class Unreadable(OSError):
    """An original cannot be read.

    That is its fault, not the disk's that takes the copy.
    """


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
        edits = source.with_name(source.name.removesuffix(SCAN_SUFFIX) + EDITS_SUFFIX)
        inside = [path for path in listing if path.is_relative_to(source) or path == edits]
        files = {str(path.relative_to(source.parent)): path for path in inside}
        return cls(folder, source, files, tuple(listing[path] for path in inside))

    @cached_property
    def own_stem(self) -> str:
        """The name of the scan without its ending."""
        if self.source.name in self.files:
            return stem_of_name(self.source.name)
        return self.source.name.removesuffix(SCAN_SUFFIX) or self.source.name

    @cached_property
    def stem(self) -> str:
        """First part of the names of its results."""
        return shortened(self.own_stem)

    @property
    def size(self) -> int:
        """Bytes of all its files."""
        return sum(stamp.size for stamp in self.stamps)

    def copy(self, to: Path) -> str:
        """Copy the files to an empty folder.

        Returns the SHA-256 digest of names and contents, hexadecimal. Raises Changed when a file is not, or no longer,
        the one that was listed, OSError when it cannot be read or the disk refuses the copy.
        """
        digest = hashlib.sha256()
        for (name, path), stamp in zip(self.files.items(), self.stamps, strict=True):
            digest.update(os.fsencode(name) + b"\0" + stamp.size.to_bytes(8, "big"))
            target = to / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with _readable(self.folder / path) as original, target.open("xb") as copy:
                while block := _read(original):
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


def shortened(name: str) -> str:
    """Return a name of at most MAX_NAME_BYTES.

    The end of a longer one becomes a digest of the whole.

    >>> shortened("page"), len(shortened("ä" * 127))
    ('page', 97)
    """
    data = os.fsencode(name)
    if len(data) <= MAX_NAME_BYTES:
        return name
    head = data[: MAX_NAME_BYTES - DIGITS - 1].decode("utf-8", "ignore")
    return f"{head}~{hashlib.sha256(data).hexdigest()[:DIGITS]}"


def _readable(path: Path) -> BinaryIO:
    try:
        return path.open("rb")
    except OSError as error:
        if error.errno == errno.ENOENT or error.errno in PASSING:
            raise
        raise Unreadable(error.errno, error.strerror, str(path)) from error


def _read(file: BinaryIO) -> bytes:
    try:
        return file.read(BLOCK)
    except OSError as error:
        if error.errno in PASSING:
            raise
        raise Unreadable(error.errno, error.strerror, file.name) from error

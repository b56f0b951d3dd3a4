"""The files that belong to a scan file.

Those that it names, or the picture of the same name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import BinaryIO

from restore.formats import IMAGE_SUFFIXES, SCAN_SUFFIXES
from station.choices import EDITS_SUFFIX
from station.intake.kept import Kept
from station.intake.listing import Listing

# How each format names other files; `restore.formats` reads them, here they are only waited for.
LINE_END = rb"(.+?)[ \t]*\r?$"
MAP_OPTIONS = rb"(?:-[a-z]+[ \t]+(?:(?:on|off|[-+.\deE]+)[ \t]+)*)*"
REFERENCES = {
    ".obj": re.compile(rb"^[ \t]*mtllib[ \t]+" + LINE_END, re.MULTILINE),
    ".mtl": re.compile(rb"^[ \t]*map_Kd[ \t]+" + MAP_OPTIONS + LINE_END, re.MULTILINE),
    ".wrl": re.compile(rb'\bfilename\s+"([^"\n]+)"'),
    ".ply": re.compile(rb"^comment[ \t]+TextureFile[ \t]+" + LINE_END, re.MULTILINE | re.IGNORECASE),
}
MARKS = {".obj": b"mtllib", ".mtl": b"map_Kd", ".wrl": b"filename"}
"""Words without which a file names no other; ten times as fast as the expressions."""
COLOURED_VERTICES = re.compile(rb"^property[ \t]+uchar[ \t]+red\b", re.MULTILINE)
SELF_CONTAINED = (".glb", ".npz", ".pcd", ".ptx", ".pts", ".xyz", ".asc", ".e57")
HEADER_BYTES = 2**16  # of a PLY: what follows may be binary
BLOCK_BYTES = 2**22
MAX_FILE_BYTES = 2**27  # of a scan file that names others
MAX_REFERENCES = 64


def is_scan(path: Path) -> bool:
    """Whether a name is that of a scan file."""
    return str(path).lower().endswith(SCAN_SUFFIXES)


@dataclass(frozen=True)
class Companions:
    """The files that belong to a scan.

    found    name under which the scan looks for a file, relative to its folder → path in the watched folder.
    missing  whether one that it names, or a picture that it may need, is not there.
    """

    found: Mapping[str, Path]
    missing: bool


@dataclass(frozen=True)
class _Content:
    """What a file says of others: their names, and whether it has its colours inside."""

    names: tuple[str, ...] = ()
    coloured: bool = False


class Pairing:
    """Finder of companions in a watched folder.

    Each file is read once for as long as it does not change.
    """

    def __init__(self, folder: Path, kept: Kept | None = None) -> None:
        """The folder, and what was kept of an earlier start."""
        self._folder = folder
        self._kept = kept or Kept()
        self._listing: Listing = {}
        self._by_name: dict[str, Path] = {}
        self._by_lower_case: dict[str, Path] = {}

    def update(self, listing: Listing) -> None:
        """Take a new listing."""
        self._listing = listing
        self._by_name = {str(path): path for path in listing}
        self._by_lower_case = {name.lower(): path for name, path in self._by_name.items()}
        self._kept.forget_others(self._by_name)

    def companions(self, source: Path) -> Companions:
        """The companions of a listed scan. Raises OSError when a file cannot be read.

        Names are compared without regard to case, as the vendor's program does.
        """
        named = dict(self._named(source, {source}))
        found = {name: path for name, path in named.items() if path is not None}
        picture = self._picture(source)
        if picture is not None:
            found.setdefault(stem_of_name(source.name) + picture.suffix.lower(), picture)
        complete = bool(found) or self._content(source).coloured
        edits = self._by_name.get(adjacent_path(source, stem_of_name(source.name) + EDITS_SUFFIX))
        if edits is not None:
            found[edits.name] = edits
        return Companions(found, missing=None in named.values() or not complete)

    def _named(self, source: Path, seen: set[Path]) -> Iterator[tuple[str, Path | None]]:
        """Yield names and paths in a file and its material files, None for missing files.

        seen: files that were read already; a material file may name itself, or the one that names it.
        """
        for name in self._content(source).names:
            path = self._lookup(source, name)
            yield (name if _is_plain(name) else str(PurePosixPath(name))), path
            if path is not None and str(path).lower().endswith(".mtl") and path not in seen:
                seen.add(path)
                yield from self._named(path, seen)

    def _content(self, path: Path) -> _Content:
        stamp, suffix = self._listing[path], path.suffix.lower()
        if suffix not in REFERENCES:
            return _Content(coloured=suffix in SELF_CONTAINED)
        if stamp.size > MAX_FILE_BYTES:  # which its reader refuses
            return _Content()
        known = self._kept.content(str(path), stamp)
        if known is None:
            found = _read(self._folder / path, suffix)
            self._kept.keep(str(path), stamp, found.names, found.coloured)
            return found
        return _Content(*known)

    def _lookup(self, source: Path, name: str) -> Path | None:
        """Return the listed file that a name in a file means.

        Never one outside the folder of that file.
        """
        inside = _inside(name)
        if inside is None:
            return None
        path = adjacent_path(source, inside)
        return self._by_name.get(path) or self._by_lower_case.get(path.lower())

    def _picture(self, source: Path) -> Path | None:
        """The picture with the name of the scan, in the order of preference."""
        stem = adjacent_path(source, stem_of_name(source.name)).lower()
        names = (stem + suffix for suffix in IMAGE_SUFFIXES)
        return next((self._by_lower_case[name] for name in names if name in self._by_lower_case), None)


def stem_of_name(name: str) -> str:
    """Return the name of a scan file without its ending.

    As `scan_stem` has it, and without a look at the disk.
    """
    name = name[:-3] if name.lower().endswith(".abs.gz") else name
    point = name.rfind(".")
    return name[:point] if 0 < point < len(name) - 1 else name


def adjacent_path(path: Path, name: str) -> str:
    """The path of a name in the folder of a file, as text."""
    place = str(path)
    return place[: len(place) - len(path.name)] + name


def _is_plain(name: str) -> bool:
    """Return whether a name is that of a file, without a folder."""
    return "/" not in name and name not in ("", ".", "..")


def _inside(name: str) -> str | None:
    """A relative path without detours; None for one that leads out of its folder."""
    if _is_plain(name):
        return name
    parts = PurePosixPath(name).parts
    return None if not parts or ".." in parts or parts[0] == "/" else "/".join(parts)


def _read(path: Path, suffix: str) -> _Content:
    """What a file says of others: at its head, where they all write it, else anywhere."""
    with path.open("rb") as file:
        data = file.read(HEADER_BYTES)
        if suffix != ".ply" and not REFERENCES[suffix].search(data.rpartition(b"\n")[0]):
            data = _with_mark(file, data, MARKS[suffix])
    names = (match.decode("utf-8", "replace").replace("\\", "/") for match in REFERENCES[suffix].findall(data))
    coloured = suffix == ".ply" and COLOURED_VERTICES.search(data) is not None
    return _Content(tuple(dict.fromkeys(names))[:MAX_REFERENCES], coloured)


def _with_mark(file: BinaryIO, head: bytes, mark: bytes) -> bytes:
    """Return the lines of a file that hold a mark.

    From block to block: never more of it at a time.
    head: what was read.
    """
    found, rest = list[bytes](), head
    while block := file.read(BLOCK_BYTES):
        lines, _, rest = (rest + block).rpartition(b"\n")
        if mark in lines:
            found += [line for line in lines.split(b"\n") if mark in line]
        rest = rest if len(rest) < BLOCK_BYTES else b""  # a line of megabytes names nothing
    return b"\n".join([*found, rest])

"""The files that belong to a scan file: those that it names, or the picture of the same name."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from restore.formats import PICTURE_SUFFIXES, SCAN_SUFFIXES, scan_stem
from station.intake.listing import Listing, Stamp

# How each format names other files; `restore.formats` reads them, here they are only waited for.
LINE_END = rb"(.+?)[ \t]*\r?$"
MAP_OPTIONS = rb"(?:-[a-z]+[ \t]+(?:(?:on|off|[-+.\deE]+)[ \t]+)*)*"
REFERENCES = {
    ".obj": re.compile(rb"^[ \t]*mtllib[ \t]+" + LINE_END, re.MULTILINE),
    ".mtl": re.compile(rb"^[ \t]*map_Kd[ \t]+" + MAP_OPTIONS + LINE_END, re.MULTILINE),
    ".wrl": re.compile(rb'\bfilename\s+"([^"\n]+)"'),
    ".ply": re.compile(rb"^comment[ \t]+TextureFile[ \t]+" + LINE_END, re.MULTILINE | re.IGNORECASE),
}
COLOURED_VERTICES = re.compile(rb"^property[ \t]+uchar[ \t]+red\b", re.MULTILINE)
SELF_CONTAINED = ".glb"
HEADER_BYTES = 2**16  # of a PLY: what follows may be binary
MAX_REFERENCES = 64


def is_scan(path: Path) -> bool:
    """Whether a name is that of a scan file."""
    return path.name.lower().endswith(SCAN_SUFFIXES)


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
    """Finds companions in a watched folder; each file is read once for as long as it does not change."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._read: dict[Path, tuple[Stamp, _Content]] = {}
        self._listing: Listing = {}
        self._by_lower_case: dict[str, Path] = {}

    def update(self, listing: Listing) -> None:
        """Take a new listing."""
        self._listing = listing
        self._by_lower_case = {str(path).lower(): path for path in listing}
        self._read = {path: known for path, known in self._read.items() if path in listing}

    def companions(self, source: Path) -> Companions:
        """The companions of a listed scan. Raises OSError when a file cannot be read.

        Names are compared without regard to case, as the vendor's program does.
        """
        named = dict(self._named(source, {source}))
        found = {name: path for name, path in named.items() if path is not None}
        picture = self._picture(source)
        if picture is not None:
            found.setdefault(scan_stem(source) + picture.suffix.lower(), picture)
        complete = bool(found) or self._content(source).coloured
        return Companions(found, missing=None in named.values() or not complete)

    def _named(self, source: Path, seen: set[Path]) -> Iterator[tuple[str, Path | None]]:
        """Names in a file and in the material files that it names, each with its path, None where there is none.

        seen: files that were read already; a material file may name itself, or the one that names it.
        """
        for name in self._content(source).names:
            path = self._lookup(source.parent, name)
            yield str(PurePosixPath(name)), path
            if path is not None and path.suffix.lower() == ".mtl" and path not in seen:
                seen.add(path)
                yield from self._named(path, seen)

    def _content(self, path: Path) -> _Content:
        stamp = self._listing[path]
        known = self._read.get(path)
        if known is None or known[0] != stamp:
            known = self._read[path] = stamp, _read(self._folder / path)
        return known[1]

    def _lookup(self, parent: Path, name: str) -> Path | None:
        """The listed file that a name in a file of the folder `parent` means; never one outside that folder."""
        parts = PurePosixPath(name).parts
        if not parts or ".." in parts or parts[0] == "/":
            return None
        path = parent.joinpath(*parts)
        return path if path in self._listing else self._by_lower_case.get(str(path).lower())

    def _picture(self, source: Path) -> Path | None:
        """The picture with the name of the scan, in the order of preference."""
        names = (str(source.parent / (scan_stem(source) + suffix)).lower() for suffix in PICTURE_SUFFIXES)
        return next((self._by_lower_case[name] for name in names if name in self._by_lower_case), None)


def _read(path: Path) -> _Content:
    suffix = path.suffix.lower()
    if suffix not in REFERENCES:
        return _Content(coloured=suffix == SELF_CONTAINED)
    with path.open("rb") as file:
        data = file.read(HEADER_BYTES) if suffix == ".ply" else file.read()
    names = (match.decode("utf-8", "replace").replace("\\", "/") for match in REFERENCES[suffix].findall(data))
    coloured = suffix == ".ply" and COLOURED_VERTICES.search(data) is not None
    return _Content(tuple(dict.fromkeys(names))[:MAX_REFERENCES], coloured)

"""A volume as an archive sees it: ordered pages, their files, and those files' events.

The encoders read these records alone, and know nothing of where and how a session keeps its files.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Literal

from station.session.terms.about import RTL, About


class Role(StrEnum):
    """Role of a file in the archive, in the terms of FADGI's guidelines.

    Source: FADGI 2023, "Digital files".
    """

    ORIGINAL = "archival master"  # as captured: never changed
    MASTER = "production master"  # the restored page with its shading, where the page is without
    PAGE = "access"  # the restored page
    WORDS = "words"  # ALTO
    TEXT = "text"
    HOCR = "hocr"
    PDF = "pdf"
    MESH = "mesh"
    REPORT = "report"
    OTHER = "derivative"


MEDIA_TYPES = {
    ".png": "image/png",
    ".tif": "image/tiff",
    ".jpg": "image/jpeg",
    ".xml": "application/xml",
    ".json": "application/json",
    ".txt": "text/plain",
    ".hocr": "application/xhtml+xml",
    ".pdf": "application/pdf",
    ".obj": "model/obj",
    ".mtl": "model/mtl",
    ".ply": "model/ply",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
    ".stl": "model/stl",
    ".npz": "application/zip",
    ".gz": "application/gzip",
    ".wrl": "model/vrml",
}
UNKNOWN_TYPE = "application/octet-stream"
UNLABELLED = "unlabelled"  # where a page without a label, or a run of them, needs a name


@dataclass(frozen=True)
class StoredFile:
    """A file of a volume.

    path    where it is now.
    name    its name in an export: relative, parts joined by /.
    sha512  hexadecimal. size: bytes. event: identifier of the event that made it.
    made    content that an export has in its place; sha512 and size are of that. None for a copy.
    """

    path: Path
    name: str
    role: Role
    sha512: str
    size: int
    event: str
    made: Callable[[], bytes] | None = None

    @property
    def media_type(self) -> str:
        """Its type (IANA)."""
        return MEDIA_TYPES.get(self.path.suffix.lower(), UNKNOWN_TYPE)


@dataclass(frozen=True)
class Event:
    """Something that happened to a volume or a page.

    kind        in the words of the Library of Congress's vocabulary of preservation events, where it has one.
    agent       the software, with its version.
    sources     names of files that it read. results: of those that it made.
    parameters  of the step, JSON values. facts: what it found. operator: who decided; empty for a program's step.
    """

    identifier: str
    kind: str
    time: datetime
    agent: str
    detail: str = ""
    sources: tuple[str, ...] = ()
    results: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)
    operator: str = ""


@dataclass(frozen=True)
class Section:
    """Successive pages of a volume that are numbered in one way, or of one kind.

    kind: run, or the kind of a page that is not counted, as cover. pages: their numbers.
    """

    label: str
    kind: str
    pages: tuple[int, ...]


@dataclass(frozen=True)
class Page:
    """Page: its number in the volume, from 1; its label; its side.

    The label is as it is printed or foliated; empty for a page that is not counted.

    provenance  of its scan: device, lens, time, … (JSON values).
    name        what the session calls it: `12`, or `12/left` for a leaf of an opened book.
    problem     why it is not as it should be; empty where none is known.
    capture     number of its scan in the session. part: page, left or right of that.
    kind        of what it shows, as of `PageEdits`; empty where it is not known.
    is_spread   whether it is two leaf sides that stayed whole.
    spine       of its scan, from head to tail, pixels of the colour image; empty without one.
    size_mm     width and height. edits: identifier of the event that corrected it; empty without one.
    """

    number: int
    label: str
    files: tuple[StoredFile, ...]
    side: Literal["left", "right", ""] = ""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""
    problem: str = ""
    capture: int = 0
    part: str = "page"
    kind: str = ""
    is_spread: bool = False
    spine: tuple[tuple[float, float], ...] = ()
    size_mm: tuple[float, float] | None = None
    edits: str = ""

    def find(self, *roles: Role) -> StoredFile | None:
        """The file of the first of these roles that it has."""
        return next((file for role in roles for file in self.files if file.role == role), None)


@dataclass(frozen=True)
class Volume:
    """Volume: identifier, title, project, organisation, pages, events.

    The organisation is empty when not given; events are in their order.
    about: its description. sections: of its pages, in their order.
    """

    identifier: str
    title: str
    pages: tuple[Page, ...]
    events: tuple[Event, ...]
    created: datetime
    project: str = ""
    organisation: str = ""
    about: About = field(default_factory=About)
    sections: tuple[Section, ...] = ()

    @property
    def shown_title(self) -> str:
        """Its title, as it is described or as the session is called."""
        return self.about.title or self.title

    @property
    def is_rtl(self) -> bool:
        """Whether it is read from right to left."""
        return self.about.direction == RTL

    @property
    def files(self) -> Iterator[StoredFile]:
        """The files of all pages, in their order; one of several pages comes once."""
        return iter({file.name: file for page in self.pages for file in page.files}.values())


def missing(volume: Volume, *wanted: Role) -> list[str]:
    """List pages without a file of the roles `wanted`, with a problem, and gaps."""
    numbers = {page.number for page in volume.pages}
    gaps = set(range(1, max(numbers, default=0) + 1)) - numbers
    lines = [f"page {number}: not captured" for number in sorted(gaps)]
    for page in volume.pages:
        problems = [LACKS[role] for role in wanted if not page.find(role)] + ([page.problem] if page.problem else [])
        lines += [f"page {page.name or page.number}: {problem}" for problem in problems]
    return lines


LACKS = {
    Role.ORIGINAL: "not captured",
    Role.PAGE: "not restored",
    Role.WORDS: "its words are not read",
    Role.MESH: "it has no mesh",
}

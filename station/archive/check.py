"""Compares every file of an export with its manifests.

It names the page that is damaged.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Literal

from restore import BadInput
from restore.files import read_regular
from station.session.fixity.tree import place_of, tree_digests
from station.session.log.bag import MANIFEST, PAYLOAD, TAG_MANIFEST
from station.session.log.events import FOLDER
from station.storage.session_folder import BAGIT, LOG

Kind = Literal["damaged", "missing", "extra", "renamed"]
LINE = re.compile(r"(?P<digest>[0-9a-f]{128})  (?P<name>[^\n]+)\n")
PAGE = re.compile(r"(?:^|/)(?:pages|images)/(\d{4})/|^(\d{4})[.-]")
MAX_MANIFEST = 2**31
AGAIN = "export the session again"
WORDS: Mapping[Kind, str] = {
    "damaged": "not the file that was written",
    "missing": "missing",
    "extra": "no part of the export",
}


@dataclass(frozen=True)
class ExportProblem:
    """One thing that is wrong with an export.

    The page that is damaged, 0 for none; the path; where a renamed file is.
    """

    kind: Kind
    page: int
    path: str
    moved_to: str = ""

    @property
    def text(self) -> str:
        """The problem in a line."""
        state = f"renamed to {self.moved_to}" if self.kind == "renamed" else WORDS[self.kind]
        return f"{place_of(self.page)}: {self.path} is {state}; {AGAIN}"


def is_export(folder: Path) -> bool:
    """Return whether a folder has a manifest, whole or damaged, and is not a session."""
    payload = folder / PAYLOAD
    events = payload.is_dir() and any(FOLDER.fullmatch(path.name) for path in payload.iterdir())
    manifests = ((folder / name).is_file() for name in (MANIFEST, TAG_MANIFEST))
    return any(manifests) and not events and not (folder / LOG).exists()


def check_export(folder: Path, *, workers: int | None = None) -> list[ExportProblem]:
    """What is wrong with an export, or with any other bag with SHA-512. Writes nothing.

    workers: threads that compute digests; one for each processor by default.
    Raises BadInput when the folder has no manifest, OSError when it cannot be read.
    """
    if not is_export(folder):
        raise BadInput(f"{folder} is not an export: it has no {MANIFEST}", "check the path")
    unlisted = TAG_MANIFEST if (folder / TAG_MANIFEST).is_file() else MANIFEST  # the manifest that no other one lists
    found = tree_digests(folder, without=unlisted, workers=workers)
    listed, broken = _listed(folder)
    problems = [ExportProblem("damaged", 0, name) for name in broken]
    missing = [name for name in listed if name not in found]
    emptied = {parent.as_posix() for name in missing for parent in PurePosixPath(name).parents}
    extra = [name for name in found if name not in listed and name not in emptied]
    for name in missing:
        moved = next((other for other in extra if found[other] == listed[name]), "")
        if moved:
            extra.remove(moved)
        problems.append(ExportProblem("renamed" if moved else "missing", page_of(name), name, moved))
    problems += [ExportProblem("extra", page_of(name), name) for name in extra]
    known = listed.keys() & found.keys()
    problems += [ExportProblem("damaged", page_of(name), name) for name in sorted(known) if found[name] != listed[name]]
    return problems


def page_of(name: str) -> int:
    """The page that a file belongs to, by its name; 0 for none."""
    match = PAGE.search(name)
    return int(match[1] or match[2]) if match else 0


def _listed(folder: Path) -> tuple[dict[str, str], list[str]]:
    """Return the digests of the manifests by file name.

    Returns also the manifests that are not as they were written. A manifest is not listed itself: that of a bag is in
    the tag manifest, the others in none.
    """
    bag = (folder / BAGIT).exists() or (folder / TAG_MANIFEST).exists() or (folder / PAYLOAD).is_dir()
    listed, broken = dict[str, str](), list[str]()
    for name in (TAG_MANIFEST, MANIFEST) if bag else (MANIFEST,):
        if not (folder / name).is_file():
            listed.setdefault(name, "")
            continue
        text = read_regular(folder / name, MAX_MANIFEST).decode("utf-8", "replace")
        lines = list(LINE.finditer(text))
        if "".join(line[0] for line in lines) != text or not lines:
            broken.append(name)
        listed |= {line["name"]: line["digest"] for line in lines}
    return listed, broken

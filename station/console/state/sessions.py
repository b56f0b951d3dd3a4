"""The sessions of a folder: listed, looked up by name, made."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from station.console.faults import ConsoleFault, problem_of
from station.session import Session, Volume, create_session, read_session
from station.session.leaves.index import entries_of
from station.session.terms.presets import PRESETS, load_preset
from station.storage.folder_lock import HOLDER_BYTES, LOCK, WORK
from station.storage.session_folder import is_session
from station.words.words import check_language, find_tesseract

MAX_LISTED = 1000
WORDS = "ocr"  # the output of a restoration that has them


def folders_of(root: Path) -> dict[str, Path]:
    """Name → folder of every session directly in a folder; links are left out."""
    with os.scandir(root) as entries:
        found = [Path(entry.path) for entry in entries if entry.is_dir(follow_symlinks=False)]
    sessions = [path for path in sorted(found) if is_session(path)]
    return {path.name: path for path in sessions[:MAX_LISTED]}


def find(root: Path, name: str) -> Path:
    """The folder of a session, looked up by its name in the listing. Raises ConsoleFault."""
    folder = folders_of(root).get(name)
    if folder is None:
        raise ConsoleFault("no_session", f"the session {name!r} does not exist here", f"sessions lie in {root}")
    return folder


def listed(root: Path, opened: str | None) -> list[dict[str, Any]]:
    """Return the sessions of a folder, the last changed one first.

    opened: the name of the one that is open here.
    """
    entries = [_entry(name, folder, opened) for name, folder in folders_of(root).items()]
    return sorted(entries, key=lambda entry: str(entry["changed"]), reverse=True)


def create(root: Path, name: str, *, preset: str, station: str, words: bool = False, **about: str) -> Path:
    """Make a session in a folder.

    words: whether the words of its pages are read. about: title, project and organisation. Raises ConsoleFault when
    something of that name is there, StationError, OSError.
    """
    if name in os.listdir(root):  # noqa: PTH208 — names, links and files among them
        raise ConsoleFault("exists", f"{name} is there already", "choose another name")
    if preset not in {path.stem for path in PRESETS.glob("*.toml")}:
        raise ConsoleFault("invalid", f"the preset {preset!r} does not exist", "see the list of presets")
    settings = load_preset(preset).model_dump(mode="json", exclude_none=True)
    if words:
        check_language(find_tesseract(), settings["language"])
        settings["outputs"] = sorted({*settings["outputs"], WORDS})
    create_session(root / name, Volume(preset=preset, station=station, preset_values=settings, **about))
    return root / name


def presets() -> list[dict[str, Any]]:
    """Return the bundled presets."""
    names = sorted(path.stem for path in PRESETS.glob("*.toml"))
    return [{"name": name, **load_preset(name).model_dump(mode="json", exclude_none=True)} for name in names]


def entry_of(session: Session, opened: str | None) -> dict[str, Any]:
    """A session in the list."""
    entry, pages = entries_of(session)
    return {
        "name": session.folder.name,
        "title": entry.title,
        "project": entry.project,
        "preset": entry.preset,
        "created": entry.created,
        "changed": entry.changed,
        "events": entry.events,
        "pages": entry.pages,
        "accepted": sum(page.state == "accepted" for page in pages),
        "open": session.folder.name == opened,
        "held_by": None if session.folder.name == opened else holder_of(session.folder),
        "problem": None,
    }


def holder_of(folder: Path) -> str | None:
    """Return the process that has a session: number, user and computer, or None.

    The kernel's table of locks decides: to try the lock would for a moment keep others from taking it. The text in a
    file without a lock was left by a killed process.
    """
    path = folder / WORK / LOCK
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        if os.fstat(descriptor).st_ino not in _locked_files(Path("/proc/locks")):
            return None
        return os.pread(descriptor, HOLDER_BYTES, 0).decode("utf-8", "replace")
    finally:
        os.close(descriptor)


def _locked_files(table: Path) -> set[int]:
    """Return the numbers (inodes) of the files with a lock.

    A line reads `1: FLOCK  ADVISORY  WRITE 4711 fe:01:131078 0 EOF`.
    """
    try:
        lines = table.read_text("ascii", "replace").splitlines()
    except OSError:
        return set()
    found = (part for line in lines if " FLOCK " in line for part in line.split() if part.count(":") == 2)
    return {int(number) for part in found if (number := part.rpartition(":")[2]).isdecimal()}


def _entry(name: str, folder: Path, opened: str | None) -> dict[str, Any]:
    try:
        return entry_of(read_session(folder), opened)
    except Exception as error:  # of any kind: a damaged session hides no other one
        empty = {"title": name, "project": "", "preset": "", "created": "", "changed": "", "events": 0, "pages": 0}
        return {"name": name, **empty, "accepted": 0, "open": False, "held_by": None, "problem": problem_of(error)}

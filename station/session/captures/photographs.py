"""Photographs of one page as one capture, restored as `planish photos` does."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from restore import BadInput, Photograph, read_photographs
from restore.files import VIDEO_SUFFIXES
from station.run.scale import Scale
from station.session.captures.scans import add_files
from station.session.log.events import Event
from station.session.log.store import Writer

FOLDER = "photographs"
SCALE = "scale"
"""Fact of a capture of photographs: their scale, as `planish photos --scale` has it."""


def add_photographs(writer: Writer, paths: Sequence[Path], *, page: int | None = None, scale: str = "card") -> Event:
    """Store photographs or a video of one page as one capture.

    Unchanged; they are restored in the order of their names.
    paths: of the files, or of one folder of them.
    Returns its event. Raises UsageError for an invalid scale, BadInput for what cannot be read or has the name of
    another, OSError.
    """
    Scale.parse(scale)
    files = _by_name(paths)
    facts = {
        "by": "session add",
        "from": [os.fsencode(path.absolute()).decode(errors="backslashreplace") for path in files.values()],
        SCALE: scale,
        "modified": {name: path.stat().st_mtime_ns for name, path in files.items()},
    }

    def provenance(copies: Path) -> dict[str, Any]:
        try:
            sizes = {copy.name: _size(copy) for copy in pictures_in(copies)}
        except BadInput as error:  # which names the copy
            raise BadInput(str(error).replace(f"{copies}/", ""), error.hint) from error
        return {"provenance": {"device": "photographs", "unit": "mm", "image_sizes_px": sizes}}

    copied = {f"{FOLDER}/{name}": path for name, path in files.items()}
    return add_files(writer, copied, FOLDER, page=page, facts=facts, inspect=provenance)


def pictures_in(folder: Path) -> list[Path]:
    """The photographs of a stored set, in the order of their names."""
    return sorted(path for path in folder.iterdir() if path.is_file())


def first_picture(folder: Path) -> Photograph:
    """Return the first photograph of a stored set.

    Raises BadInput when it is damaged, or the set is a video.
    """
    first = next(iter(pictures_in(folder)), None)
    if first is None:
        raise BadInput(f"{folder} holds no photographs", "planish verify shows more")
    if _is_video(first):
        raise BadInput(f"{first.name} is a video, which is not shown", "look at the restored page")
    return read_photographs([first])[0]


def _is_video(path: Path) -> bool:
    return path.suffix.lower() in VIDEO_SUFFIXES


def _by_name(paths: Sequence[Path]) -> dict[str, Path]:
    if len(paths) == 1 and paths[0].is_dir():
        paths = pictures_in(paths[0])
        if not paths:
            raise BadInput("the folder holds no files", "give the folder of the photographs, or the photographs")
    files: dict[str, Path] = {}
    for path in paths:
        if not path.exists():
            raise BadInput(f"{path} is not there", "check the name and the folder")
        if not path.is_file():
            raise BadInput(f"{path} is not a file", "give the photographs, or one folder of them and nothing else")
        if path.name in files:
            raise BadInput(f"{files[path.name]} and {path} have one name", "rename one of them")
        files[path.name] = path
    return files


def _size(path: Path) -> list[int] | None:
    """Return width and height of a photograph, None for a video.

    Raises BadInput when it cannot be read.
    """
    return None if _is_video(path) else [*read_photographs([path])[0].image.shape[1::-1]]

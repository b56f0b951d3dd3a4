"""Atomic output of all files of a run.

They are staged in a hidden folder, flushed and moved in one step, or none is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import chain
from pathlib import Path

from station.errors import OverwriteError
from station.storage.disk import Contents, named_as, sync_folder, sync_tree, write_file
from station.storage.folder_lock import FolderLock, lock_folder
from station.storage.journal import replace_files

OVERWRITE_HINT = "add --force to overwrite, or choose another place"
CAPTURE_HINT = "add --force to store the new scan next to it, or choose another folder with -o"
FOLDER_HINT = "rename that folder, or choose another place"


def write_all(
    files: Iterable[tuple[Path, Contents]],
    *,
    force: bool = False,
    lock: FolderLock | None = None,
    superseded: Iterable[Path] = (),
) -> list[Path]:
    """Write every file or, if anything fails, none of them.

    The files come one at a time, so that a generator keeps one of them in memory and no more.
    lock: of the folder, where the run has one already, as `lock_output_folder` gives it.
    superseded: files of an earlier run in the same folder that go in the same step.
    Returns the paths, all in one folder. Raises OverwriteError when a file exists and `force` is not set, FolderInUse
    when another run writes to the folder, OSError when the disk refuses.
    """
    files = iter(files)
    first = next(files, None)
    if first is None:
        return []
    if lock is None:
        with lock_output_folder(first[0].parent) as own:
            return _write_all(chain([first], files), own, force, superseded)
    return _write_all(chain([first], files), lock, force, superseded)


def _write_all(
    files: Iterable[tuple[Path, Contents]], lock: FolderLock, force: bool, superseded: Iterable[Path]
) -> list[Path]:
    lock.new.mkdir(exist_ok=True)
    paths = []
    for path, data in files:
        try:
            write_file(lock.new / path.name, data)
        except OSError as error:
            error.filename = str(path)  # the staging folder is not the operator's concern
            raise
        paths.append(path)
    refuse_existing(paths, force=force)
    names = [path.name for path in paths]
    gone = [path.name for path in superseded if path.name not in names]
    replace_files(lock.folder, lock.work, names, gone)
    return paths


@contextmanager
def new_folder(lock: FolderLock, name: str, *, hint: str = CAPTURE_HINT) -> Iterator[Path]:
    """Yield a staging folder that becomes `name` in the locked folder.

    When the block ends without an error. Raises OverwriteError with the hint when something of that name exists: it is
    never replaced.
    """
    staged, path = lock.new / name, lock.folder / name
    lock.new.mkdir(exist_ok=True)
    with named_as(staged, path):
        yield staged
        sync_tree(staged)
    refuse_captured([path], hint)
    staged.rename(path)
    sync_folder(lock.folder)


def refuse_existing(paths: Iterable[Path], *, force: bool) -> None:
    """Raise OverwriteError for the first path that exists.

    With `force` only for a folder, which is not a result.
    """
    for path in paths:
        if path.is_dir() and not path.is_symlink():
            raise OverwriteError(f"{path} is a folder, where a file is to be written", FOLDER_HINT)
        if not force and os.path.lexists(path):
            raise OverwriteError(f"{path} is there already", OVERWRITE_HINT)


def refuse_captured(folders: Iterable[Path], hint: str = CAPTURE_HINT) -> None:
    """Raise OverwriteError for the first folder of a capture that is there."""
    for folder in folders:
        if os.path.lexists(folder):
            raise OverwriteError(f"{folder} is there already", hint)


@contextmanager
def lock_output_folder(folder: Path) -> Iterator[FolderLock]:
    """Create the folder, and lock it for this run while the block runs.

    A disk that refuses is better met before the work than after it. When the block fails, no folder that was made for
    it stays behind empty. Raises FolderInUse when another run writes to the folder, OSError when the disk refuses.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with lock_folder(folder) as lock:
            yield lock
    except BaseException:
        with suppress(OSError):  # what was written stays, and its folder with it
            for path in made:
                path.rmdir()
        raise

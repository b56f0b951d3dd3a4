"""Write all files of a run or none: staged beside their places, flushed to the disk, renamed at the end."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from station.errors import OverwriteError

NAME_KEPT = 32
OVERWRITE_HINT = "add --force to overwrite, or choose another folder with -o"


def write_all(files: Iterable[tuple[Path, bytes]], *, force: bool = False) -> list[Path]:
    """Write every file, or, whatever goes wrong on the way, none of them. Returns the paths.

    The files come one at a time, so that a generator keeps one of them in memory and no more.
    Raises OverwriteError when a file is there and `force` is not set, OSError when the disk refuses.
    """
    staged: list[tuple[Path, Path]] = []
    try:
        for path, data in files:
            part = _part(path)
            staged.append((part, path))
            _write(part, data)
        refuse_existing([path for _, path in staged], force=force)
        for part, path in staged:
            part.replace(path)
    finally:  # what was renamed is not there any more
        for part, _ in staged:
            part.unlink(missing_ok=True)
    return [path for _, path in staged]


@contextmanager
def new_folder(path: Path, *, force: bool = False) -> Iterator[Path]:
    """A folder to fill that appears at `path` complete, when the block ends without an error, or not at all.

    Raises OverwriteError when `path` is there and `force` is not set.
    """
    part = _part(path)
    shutil.rmtree(part, ignore_errors=True)
    try:
        yield part
        _sync(part)
        refuse_existing([path], force=force)
        _swap(part, path)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def refuse_existing(paths: Iterable[Path], *, force: bool) -> None:
    """Raise OverwriteError for the first path that is there, unless `force` is set."""
    if force:
        return
    for path in paths:
        if os.path.lexists(path):
            raise OverwriteError(f"{path} is there already", OVERWRITE_HINT)


@contextmanager
def writable(folder: Path) -> Iterator[None]:
    """Make the folder, and try it: a disk that refuses is better met before the work than after it. Raises OSError.

    When the block fails, no folder that was made for it stays behind empty.
    """
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _try(_part(folder / "probe"))
        yield
    except BaseException:
        with suppress(OSError):  # what was written stays, and its folder with it
            for path in made:
                path.rmdir()
        raise


def _try(probe: Path) -> None:
    try:
        _write(probe, b"\0")
    finally:
        probe.unlink(missing_ok=True)


def _part(path: Path) -> Path:
    return _beside(path, "part")


def _beside(path: Path, kind: str) -> Path:
    # The end of the name tells the files of a run apart and keeps it short; the process keeps two runs apart.
    return path.with_name(f".{path.name[-NAME_KEPT:]}.{os.getpid()}.{kind}")


def _write(path: Path, data: bytes) -> None:
    with path.open("wb") as file:
        _flush_out(file, data)


def _flush_out(file: BinaryIO, data: bytes) -> None:
    file.write(data)
    file.flush()
    os.fsync(file.fileno())


def _sync(folder: Path) -> None:
    for path in folder.rglob("*"):
        if path.is_file():
            with path.open("rb") as file:
                os.fsync(file.fileno())


def _swap(part: Path, path: Path) -> None:
    """Put the folder `part` in the place of `path`; what was there goes only when the new one stands."""
    old = _beside(path, "old")
    there = os.path.lexists(path)
    if there:
        path.rename(old)
    try:
        part.rename(path)
    except OSError:
        if there:
            old.rename(path)
        raise
    if there:
        shutil.rmtree(old) if old.is_dir() else old.unlink()

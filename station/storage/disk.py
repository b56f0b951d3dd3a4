"""Durable writes (fsync), with the path in every error."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import BinaryIO

CHUNK_BYTES = 2**20  # read at a time: a file may be larger than the memory

Contents = bytes | Callable[[BinaryIO], None]  # of a file, or what writes them to it, part by part


def write_file(path: Path, data: Contents) -> None:
    """Write a new file and flush it to the disk. Raises OSError that names it."""
    with add_path_to_errors(path), path.open("wb") as file:
        write_and_sync(file, data)


def copy_file(source: Path, target: Path) -> None:
    """Write a copy of a file's content.

    Raises OSError that names the one of the two that the disk refuses.
    """
    with add_path_to_errors(target), target.open("wb") as file:
        for chunk in _chunks(source):
            file.write(chunk)


def _chunks(path: Path) -> Iterator[bytes]:
    with add_path_to_errors(path), path.open("rb") as file:
        while chunk := file.read(CHUNK_BYTES):
            yield chunk


def write_and_sync(file: BinaryIO, data: Contents) -> None:
    """Write all data and flush it to the disk."""
    if callable(data):
        data(file)
    else:
        file.write(data)
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk.

    A file is found again after a power cut only then.
    """
    with add_path_to_errors(folder):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def sync_tree(folder: Path) -> None:
    """Flush every file and folder under a folder, and the folder itself."""
    for path in folder.rglob("*"):
        if path.is_dir():
            sync_folder(path)
        else:
            with add_path_to_errors(path), path.open("rb") as file:
                os.fsync(file.fileno())
    sync_folder(folder)


def free_folder(folder: Path) -> Path:
    """A folder that is not there: the one given, or with the first number that is free."""
    names = chain([folder], (folder.with_name(f"{folder.name}-{number}") for number in count(2)))
    return next(name for name in names if not os.path.lexists(name))


@contextmanager
def add_path_to_errors(path: Path) -> Iterator[None]:
    """Set the path in OSErrors that have none, as those of write and fsync."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


@contextmanager
def named_as(staged: Path, final: Path) -> Iterator[None]:
    """Name the final place in OSErrors about what is staged for it.

    The staging folder is not the operator's concern.
    """
    try:
        yield
    except OSError as error:
        name = error.filename
        if isinstance(name, str) and Path(name).is_relative_to(staged):
            error.filename = str(final / Path(name).relative_to(staged))
        raise

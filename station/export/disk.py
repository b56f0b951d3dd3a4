"""Writing that has reached the disk when it returns, with the path in every error."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


def write_file(path: Path, data: bytes) -> None:
    """Write a new file and flush it to the disk. Raises OSError that names it."""
    with named(path), path.open("wb") as file:
        flush_out(file, data)


def flush_out(file: BinaryIO, data: bytes) -> None:
    """Write all data and flush it to the disk."""
    file.write(data)
    file.flush()
    os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk: a file is found again after a power cut only then."""
    with named(folder):
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
            with named(path), path.open("rb") as file:
                os.fsync(file.fileno())
    sync_folder(folder)


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Put the path into OSErrors that name no file, as those of write and fsync."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise

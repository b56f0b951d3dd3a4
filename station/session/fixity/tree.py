"""The files of a folder and their digests, which `verify` compares with records."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from station.session.log.store import file_digest


def tree_digests(folder: Path, *, without: str, workers: int | None = None) -> dict[str, str]:
    """Map path to SHA-512 of every file, link and empty folder, in alphabetical order.

    What is not a regular file or cannot be read has a word in place of a digest.
    without: path of a file or folder that is left out.
    workers: threads; one for each processor by default.
    Raises OSError for a folder.
    """
    names = sorted(_walk(folder, without))
    with ThreadPoolExecutor(workers or len(os.sched_getaffinity(0))) as pool:
        return dict(zip(names, pool.map(lambda name: _digest(folder / name), names), strict=True))


def place_of(page: int) -> str:
    """What a problem is reported of: a page, or the volume for page 0."""
    return f"page {page}" if page else "the volume"


def _walk(folder: Path, without: str) -> Iterator[str]:
    for base, folders, files in os.walk(folder):
        here = Path(base).relative_to(folder)
        if without in folders and base == str(folder):
            folders.remove(without)
        names = [*files, *(name for name in folders if (folder / here / name).is_symlink())]
        if not names and not folders:
            yield here.as_posix()
        yield from (path for name in names if (path := (here / name).as_posix()) != without)


def _digest(path: Path) -> str:
    if path.is_symlink() or not path.is_file():
        return "no regular file"
    try:
        return file_digest(path)
    except OSError as error:
        return f"unreadable: {error.strerror}"

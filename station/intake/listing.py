"""The content of the watched folder: sizes, times, and how long each is unchanged.

The folder is listed again and again instead of waiting for the kernel's events (inotify): those do not come for what
another computer writes to a network share, and a network share is where a vendor's program on Windows puts its files.
"""

from __future__ import annotations

import fcntl
import os
import signal
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from station.storage.session_folder import is_session

MAX_DEPTH = 16  # of sub-folders; more is a circle of mounts


class Stamp(NamedTuple):
    """What changes with the content of a file: size in bytes, modification time in ns.

    Not the inode: some network shares make up another one each time.
    """

    size: int
    modified_ns: int

    @classmethod
    def of(cls, status: os.stat_result) -> Stamp:
        """The stamp of a file's status."""
        return cls(status.st_size, status.st_mtime_ns)


Listing = Mapping[Path, Stamp]
"""Path relative to the watched folder → stamp."""


def list_files(
    folder: Path, *, without: Path, left_out: Callable[[Path], object] = lambda _: None
) -> dict[Path, Stamp]:
    """List every regular file in a folder and below, except hidden ones.

    Links to folders are not followed; a sub-folder that cannot be read counts as empty.
    without: a folder that is left out with all that is in it.
    left_out: called with every session below the folder, relative to it: its scans are those of its own record.
    Raises OSError when the folder cannot be read.
    """
    with os.scandir(folder) as entries:
        return dict(_walk(list(entries), Path(), without, left_out, MAX_DEPTH))


def _walk(
    entries: list[os.DirEntry[str]], below: Path, without: Path, left_out: Callable[[Path], object], depth: int
) -> Iterator[tuple[Path, Stamp]]:
    for entry in sorted(entries, key=lambda entry: entry.name):
        if entry.name.startswith("."):  # rsync and others write to a hidden file, and rename it when it is complete
            continue
        try:
            if entry.is_dir(follow_symlinks=False):
                if not depth or Path(entry.path) == without:
                    continue
                if is_session(Path(entry.path)):
                    left_out(below / entry.name)
                    continue
                with os.scandir(entry.path) as inner:
                    yield from _walk(list(inner), below / entry.name, without, left_out, depth - 1)
            elif entry.is_file():
                yield below / entry.name, Stamp.of(entry.stat())
        except OSError:  # gone in the meantime, or not ours to read
            continue


class Quiet:
    """Since when each file has not changed.

    By this computer's clock: those of other computers differ.
    listing: the last one.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._seen: dict[Path, tuple[Stamp, float]] = {}
        self.listing: Listing = {}

    def update(self, listing: Listing) -> None:
        """Take note of a new listing."""
        now, before, self.listing = self._clock(), self._seen, listing
        self._seen = {
            path: before[path] if path in before and before[path][0] == stamp else (stamp, now)
            for path, stamp in listing.items()
        }

    def seconds(self, path: Path) -> float:
        """Seconds for which a file of the last listing has not changed."""
        return self._clock() - self._seen[path][1]


def has_writer(path: Path) -> bool:
    """Return whether some program has the file open for writing.

    As far as the kernel knows; False on most network shares. A read lease is refused for such a file: fcntl(2),
    F_SETLEASE. It is returned at once.
    """
    try:
        # A program that opens the file just now breaks the lease; the signal of that would end the process.
        before = signal.signal(signal.SIGIO, signal.SIG_IGN)
    except ValueError:  # not in the main thread
        return False
    try:
        with path.open("rb") as file:
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_RDLCK)
            fcntl.fcntl(file, fcntl.F_SETLEASE, fcntl.F_UNLCK)
        return False
    except BlockingIOError:
        return True
    except OSError:  # another user's file, a file system without leases, or the file has gone
        return False
    finally:
        signal.signal(signal.SIGIO, before)

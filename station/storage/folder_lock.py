"""Exclusive use of an output folder: a lock of its process, and a hidden staging folder."""

from __future__ import annotations

import errno
import fcntl
import os
import pwd
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from station.errors import FolderInUse
from station.storage.disk import add_path_to_errors
from station.storage.journal import JOURNAL, NEW, OLD, roll_back

WORK = ".planish-run"
LOCK = "lock"
HOLDER_BYTES = 400  # a process number, a user's name and a host's, of at most 255 bytes


@dataclass(frozen=True)
class FolderLock:
    """A folder that this run alone writes to.

    folder  the folder of the results.
    work    hidden folder in it, on the same disk: new files, the files they replace, the journal, the lock.
    """

    folder: Path

    @property
    def work(self) -> Path:
        return self.folder / WORK

    @property
    def new(self) -> Path:
        """Staging folder of new files."""
        return self.work / NEW


@contextmanager
def lock_folder(folder: Path) -> Iterator[FolderLock]:
    """Lock an existing folder for this run.

    After rolling back an unfinished replacement of a dead run. Raises FolderInUse when another run has locked it,
    OSError when the disk refuses.
    """
    lock = FolderLock(folder)
    try:
        descriptor = _lock(lock)
    except BaseException:
        with suppress(OSError):  # the folder of another run is not empty
            lock.work.rmdir()
        raise
    try:
        _restore_order(lock)
        yield lock
    finally:
        try:
            _clean(lock)
        finally:
            os.close(descriptor)


def recover(folder: Path) -> bool:
    """Roll back the unfinished replacement of a dead run in a folder.

    Does nothing where nothing was left, or where a live run is at work. Returns True when something was rolled back.
    Raises OSError when the disk refuses.
    """
    if not (folder / WORK).is_dir():
        return False
    try:
        with lock_folder(folder):
            return True
    except FolderInUse:
        return False


def _lock(lock: FolderLock) -> int:
    """Take the lock, and write into it who holds it. Returns the descriptor that does."""
    path = lock.work / LOCK
    while True:
        lock.work.mkdir(exist_ok=True)
        if lock.work.is_symlink():
            raise FileExistsError(errno.EEXIST, "a link stands where the run keeps its files", str(lock.work))
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
        except FileNotFoundError:  # a run that ended has just removed the folder
            continue
        try:
            if _is_taken(lock, path, descriptor):
                return descriptor
        except BaseException:
            os.close(descriptor)
            raise
        os.close(descriptor)  # the lock of a run that ended in the meantime


def _is_taken(lock: FolderLock, path: Path, descriptor: int) -> bool:
    """Lock the open file.

    Returns False when it is no longer the one at `path`. Raises FolderInUse.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        owner = os.pread(descriptor, HOLDER_BYTES, 0).decode("utf-8", "replace")
        raise FolderInUse(lock.folder, owner) from None
    if not _is_open_file(path, descriptor):
        return False
    try:
        with add_path_to_errors(path):
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, _holder().encode("utf-8", "replace")[:HOLDER_BYTES], 0)
            os.fsync(descriptor)  # a disk that refuses is better met before the work than after it
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    return True


def _holder() -> str:
    """Return the name of this process, its user and its computer.

    A session on a network disk is opened from several.
    """
    try:
        user = pwd.getpwuid(os.getuid()).pw_name
    except KeyError:  # a user that this system has no name for
        user = str(os.getuid())
    return f"{os.getpid()} of {user} on {socket.gethostname()}"


def _is_open_file(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False


def _restore_order(lock: FolderLock) -> None:
    """Undo the unfinished replacement of a dead run, then remove its files."""
    roll_back(lock.folder, lock.work)
    for leftover in lock.work.iterdir():
        if leftover.name != LOCK:
            shutil.rmtree(leftover) if leftover.is_dir() and not leftover.is_symlink() else leftover.unlink()


def _clean(lock: FolderLock) -> None:
    """Remove the hidden folder, the lock last.

    While a journal exists, the next run still needs it.
    """
    if (lock.work / JOURNAL).exists():
        with suppress(OSError):
            (lock.work / LOCK).unlink()
        return
    for part in (lock.work / NEW, lock.work / OLD):
        shutil.rmtree(part, ignore_errors=True)
    with suppress(OSError):  # whatever is left is removed by the next run
        (lock.work / LOCK).unlink()
        lock.work.rmdir()

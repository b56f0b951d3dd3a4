"""Exclusive lock on a device node, and the process that holds it.

The lock is `flock(2)`: the kernel lists its holder for every user in /proc/locks, and drops it when the process ends,
however it ends.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from drivers.scanner import TransportError

PROC = Path("/proc")
SHOWN_COMMAND = 80  # characters of a command line in a message
IN_USE_HINT = "wait until it has finished with the scanner, or end it"


def lock_node(descriptor: int, node: Path) -> None:
    """Lock an open device node until the descriptor is closed.

    Raises TransportError that names the holder.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise in_use(node) from error


def open_locked(node: Path) -> int | None:
    """Open a device node and lock it; return None if it cannot be opened.

    The lock lasts as long as the descriptor is open. Raises TransportError that names the holder.
    """
    try:
        descriptor = os.open(node, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:  # opening it for use is refused and reported as well
        return None
    try:
        lock_node(descriptor, node)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def in_use(node: Path, proc: Path = PROC) -> TransportError:
    """The error for a node that another process uses."""
    names = [process_name(pid, proc) for pid in holders(node, proc)]
    return TransportError(f"{node} is in use by {' and '.join(names) or 'another program'}", IN_USE_HINT)


def holders(node: Path, proc: Path = PROC) -> list[int]:
    """Return the processes that have a lock on a node.

    Where none has, those of this user that have it open.
    """
    return sorted(set(_lockers(node, proc)) or set(_openers(node, proc)))


def process_name(pid: int, proc: Path = PROC) -> str:
    """A process in words: its number and its command line."""
    if pid == os.getpid():
        return "this program itself"
    try:
        words = (proc / str(pid) / "cmdline").read_bytes().decode("utf-8", "replace").split("\0")
    except OSError:
        words = []
    command = " ".join(filter(None, words))
    shown = command if len(command) <= SHOWN_COMMAND else f"{command[:SHOWN_COMMAND]}…"
    return f"process {pid}" + (f" ({shown})" if shown else "")


def _lockers(node: Path, proc: Path) -> Iterator[int]:
    """Yield the lock holders that proc_locks(5) lists.

    A line reads `1: FLOCK ADVISORY WRITE <pid> <major>:<minor>:<inode> 0 EOF`.
    """
    try:
        file = node.stat()
        lines = (proc / "locks").read_text("ascii", "replace").splitlines()
    except OSError:
        return
    wanted = (os.major(file.st_dev), os.minor(file.st_dev), file.st_ino)
    for words in map(str.split, lines):
        if len(words) < 6 or words[1] == "->":  # a process that waits for a lock
            continue
        major, minor, inode = words[5].split(":")
        if (int(major, 16), int(minor, 16), int(inode)) == wanted and int(words[4]) > 0:
            yield int(words[4])


def _openers(node: Path, proc: Path) -> Iterator[int]:
    for entry in proc.glob("[0-9]*/fd/*"):
        with suppress(OSError):
            if entry.readlink() == node:
                yield int(entry.parts[-3])

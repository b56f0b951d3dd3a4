"""Errors of the station, and the message, hints and exit code of every error.

StationError        base class; carries the exit code and the remedy
├── JournalDamaged  an interrupted run cannot be rolled back (exit code 6)
└── UsageError      the command or the configuration asks for something that cannot be (exit code 2)
    ├── FolderInUse     another run writes to the folder
    └── OverwriteError  a file that would be written is there already

Stopped             the process received a signal to end
"""

from __future__ import annotations

import errno
import os
import signal
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from drivers.scanner import LASER_MAY_BE_ON
from station import interrupt

UNEXPECTED, USAGE, DISK = 1, 2, 6
SET_ASIDE = 7  # of a batch that has come to its end, with pages that could not be restored
STANDARD_OUTPUT = "standard output"  # in place of a file's name
SIGNAL_BASE = 128  # a shell reports a process that signal n has ended as 128 + n


class StationError(Exception):
    """An error that ends a session. `hint` is the remedy; `exit_code` is the command's."""

    exit_code = UNEXPECTED

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class UsageError(StationError):
    """An option or a key of the configuration is not usable.

    Raised before any work; the message names it.
    """

    exit_code = USAGE


class OverwriteError(UsageError):
    """Raised instead of overwriting a file."""


class FolderInUse(UsageError):
    """Raised when another run writes to a folder; names its process."""

    def __init__(self, folder: Path, process: str) -> None:
        super().__init__(
            f"{folder} is in use by another run, process {process or 'unknown'}",
            "wait until it has ended, or use another folder",
        )
        self.process = process


class JournalDamaged(StationError):
    """The journal of an interrupted run cannot be read.

    The message names where the earlier files are.
    """

    exit_code = DISK

    def __init__(self, work: Path, reason: str) -> None:
        super().__init__(
            f"the journal of an interrupted run in {work} is damaged: {reason}",
            f"move the files in {work / 'old'} back to {work.parent}, then remove {work}",
        )


class Stopped(BaseException):
    """The process received a signal to end.

    The scanner is released and partial files are removed.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.exit_code = SIGNAL_BASE + number


@runtime_checkable
class ReportedError(Protocol):
    """Protocol of errors of station, restore and drivers with an exit code and a hint."""

    exit_code: int
    hint: str


@dataclass(frozen=True)
class Fault:
    """Error for the operator: exit code of the command, message, hints of one line each."""

    exit_code: int
    message: str
    hints: tuple[str, ...]


NO_RIGHT = "you may not write there, or not read: use another folder, or ask for the right to"
DISK_HINTS = {
    errno.ENOSPC: "free some space{disk}, or use another disk",
    errno.EDQUOT: "free some of your quota, or use another disk",
    errno.EFBIG: "the disk takes no file this large: use another, or lower --dpi, where the command has it",
    errno.EROFS: "the disk is read-only: use another",
    errno.EACCES: NO_RIGHT,
    errno.EPERM: NO_RIGHT,
    errno.ENOTDIR: "part of that path is a file: use another folder",
    errno.EEXIST: "that path is a file: use another folder",
    errno.ENAMETOOLONG: "the name is too long for this disk: choose a shorter one",
    errno.EIO: "reading and writing fails{disk}: use another, and save what is on that one",
}


def explain(error: BaseException) -> Fault:
    """Return the fault that describes any error.

    Notes added to the error (`add_note`) become further hints.
    """
    code, message, hint = _describe(_interruption(error) or error)
    lines = dict.fromkeys(line for line in (hint, *getattr(error, "__notes__", ())) if line)
    warning = [LASER_MAY_BE_ON] if LASER_MAY_BE_ON in lines else []  # the last line, where the eye rests
    return Fault(code, message, (*(line for line in lines if line not in warning), *warning))


def _interruption(error: BaseException | None) -> BaseException | None:
    """Return the interruption that caused the error, if any.

    Native libraries raise their own errors on a signal.
    """
    while error and not isinstance(error, KeyboardInterrupt | Stopped):
        error = error.__cause__ or error.__context__
    return error


def _describe(error: BaseException) -> tuple[int, str, str]:
    match error:
        case ReportedError():
            return error.exit_code, str(error), error.hint
        case OSError():
            return DISK, _disk_message(error), _disk_hint(error)
        case KeyboardInterrupt():
            return interrupt.EXIT_CODE, interrupt.MESSAGE, interrupt.HINT
        case Stopped():
            return error.exit_code, f"stopped by {error}", interrupt.HINT
        case MemoryError():
            return (
                UNEXPECTED,
                "the memory is full",
                "close other programs, or lower --dpi and --points, where the command has them",
            )
    message = f"unexpected fault: {type(error).__name__}: {error}".splitlines()[0]
    return UNEXPECTED, message, "run again with --debug to see where it happened"


def _disk_hint(error: OSError) -> str:
    """The hint for an I/O error, with the mount point of the disk."""
    hint = DISK_HINTS.get(error.errno or 0, "use another folder")
    return hint.format(disk=_mounted_at(error.filename))


def _mounted_at(path: object) -> str:
    """Return " on the disk at <mount point>" for the path of a file.

    Also for one in a folder that is gone, and for a circle of links; empty without a path.
    """
    if not isinstance(path, str) or path == STANDARD_OUTPUT:
        return ""
    try:
        folder = next(folder for folder in Path(os.path.realpath(path)).parents if folder.is_dir())
        while not folder.is_mount():
            folder = folder.parent
    except (OSError, ValueError):  # of a name that no disk takes
        return ""
    return f" on the disk at {folder}"


def _disk_message(error: OSError) -> str:
    reason = error.strerror or str(error)
    doing = (
        "cannot use" if error.errno in (errno.EACCES, errno.EPERM) else "cannot write"
    )  # a right is missed in reading, too
    return f"{doing} {error.filename}: {reason}" if error.filename else f"{doing}: {reason}"

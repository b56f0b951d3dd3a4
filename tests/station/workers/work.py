"""What pages may do to the process that restores them: functions that it can import."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from pathlib import Path


def double(number: int, causes: tuple[str, ...]) -> int:
    return 2 * number


def process_number(_: object, causes: tuple[str, ...]) -> int:
    return os.getpid()


def read_nothing(_: object, causes: tuple[str, ...]) -> int:
    ctypes.string_at(0)
    return 0


def crash_twice(_: object, causes: tuple[str, ...]) -> tuple[str, ...]:
    """As a damaged scan would: the work that is told of two crashes sets it aside."""
    if len(causes) < 2:
        read_nothing(_, causes)
    return causes


def crash_on_odd(number: int, causes: tuple[str, ...]) -> str:
    """A crash for every odd number, however often it is tried; the third try sets it aside."""
    if number % 2 and len(causes) < 2:
        read_nothing(number, causes)
    return "set aside" if causes else "restored"


def take_memory(mib: int, causes: tuple[str, ...]) -> int:
    return len(bytearray(mib * 2**20))


def sleep(seconds: float, causes: tuple[str, ...]) -> bool:
    if causes:
        return False
    time.sleep(seconds)
    return True


def refuse(_: object, causes: tuple[str, ...]) -> None:
    from restore import BadInput  # the others begin in a tenth of the time

    error = BadInput("the scan is damaged", "scan again")
    error.add_note("the scan is safe")
    raise error


def fill_disk(_: object, causes: tuple[str, ...]) -> None:
    raise OSError(28, "No space left on device", "/data/page.png")


def say_when_interrupted(folder: str, causes: tuple[str, ...]) -> None:
    """Writes that it has begun, then that it was told to end."""
    Path(folder, "begun").touch()
    try:
        signal.pause()
    except BaseException:
        Path(folder, "ended in order").touch()
        raise


def note_number(task: tuple[str, int], causes: tuple[str, ...]) -> int:
    """One line more in a file of the page's own: how often was it done?"""
    folder, number = task
    with Path(folder, str(number)).open("a") as file:
        file.write(f"{os.getpid()}\n")
    return number

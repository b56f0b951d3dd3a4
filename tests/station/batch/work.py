"""What pages may do to the process that restores them: functions that it can import."""

from __future__ import annotations

import os

from restore import BadInput


def double(number: int, causes: tuple[str, ...]) -> int:
    return 2 * number


def process_number(_: object, causes: tuple[str, ...]) -> int:
    return os.getpid()


def refuse(_: object, causes: tuple[str, ...]) -> None:
    error = BadInput("the scan is damaged", "scan again")
    error.add_note("the scan is safe")
    raise error


def fill_disk(_: object, causes: tuple[str, ...]) -> None:
    raise OSError(28, "No space left on device", "/data/page.png")

"""Extracts SCSI commands from a capture of the USB bus.

They are the vendor program's; a command profile is drafted from them.
"""

from __future__ import annotations


class CaptureError(Exception):
    """A capture cannot be read, or contains no commands.

    `hint` says what to do now.
    """

    exit_code = 3

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint

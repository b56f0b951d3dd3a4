"""Extracts the vendor program's SCSI commands from a capture of the USB bus, and drafts a command profile."""

from __future__ import annotations


class CaptureError(Exception):
    """Raised when a capture cannot be read, or contains no commands. `hint` says what to do now."""

    exit_code = 3

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint

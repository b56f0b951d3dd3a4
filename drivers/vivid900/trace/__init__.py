"""Reads what the vendor's own program says to the scanner out of a capture of the USB bus, and drafts a profile."""

from __future__ import annotations


class CaptureError(Exception):
    """Raised when a capture cannot be read, or has nothing in it to read. `hint` says what to do now."""

    exit_code = 3

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint

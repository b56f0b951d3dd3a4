"""The error of an invalid answer."""

from __future__ import annotations

from drivers.scanner import TransportError

SCAN_AGAIN = "scan again; if it comes back, check cables, termination and the SCSI ID"


class BadReply(TransportError):
    """The answer is too short, too long, damaged, or of another command."""

    def __init__(self, message: str, hint: str = SCAN_AGAIN) -> None:
        super().__init__(message, hint)

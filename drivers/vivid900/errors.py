"""What can go wrong with a Vivid 900, drawn in one place.

SettingsError               the caller's fault
├── CommandRefused          the scanner does not know a command or one of its parameters: ILLEGAL REQUEST
└── ProfileMismatch         the command profile does not declare itself for the scanner that answered
DeviceError                 the scanner's fault, or what stands before it
├── NotReady                warming up, or not to be used for another reason: NOT READY
│   └── BarrierClosed       the laser barrier stands before the laser
├── StillBusy               busy longer than any of its operations takes
├── PanelError              the front panel shows a message of the manual's list
└── HardwareFault           HARDWARE ERROR, MEDIUM ERROR and whatever else it says of itself
TransportError              the way's fault
├── Interrupted             it lost what it was doing: UNIT ATTENTION, ABORTED COMMAND, a shot that is an earlier one's
└── BadReply                an answer that the command could not have had

Interrupted and BadReply are worth a second try from the first command on; nothing else is.
"""

from __future__ import annotations

from drivers.scanner import DeviceError, SettingsError, TransportError

AGAIN = "scan again; if it comes back, check cables, termination and the SCSI ID"


class CommandRefused(SettingsError):
    """Raised when the scanner refuses a command or a parameter as unknown to it."""


class ProfileMismatch(SettingsError):
    """Raised before any command of a profile is sent to a scanner that the profile does not declare itself for."""


class NotReady(DeviceError):
    """Raised when the scanner answers but cannot be used yet."""


class BarrierClosed(NotReady):
    """Raised when the laser barrier stands before the laser."""


class StillBusy(DeviceError):
    """Raised when the scanner stays busy longer than any of its operations takes."""


class PanelError(DeviceError):
    """Raised for a message of the front panel. `panel` is its text."""

    def __init__(self, panel: str, message: str, hint: str) -> None:
        super().__init__(message, hint)
        self.panel = panel


class HardwareFault(DeviceError):
    """Raised when the scanner reports that a part of it has failed."""


class Interrupted(TransportError):
    """Raised when the scanner was reset, or lost the command it was doing."""


class BadReply(TransportError):
    """Raised when an answer is too short, too long, damaged, or of something that was not asked."""

    def __init__(self, message: str, hint: str = AGAIN) -> None:
        super().__init__(message, hint)

"""The errors of a Vivid 900 and their tree.

SettingsError               the caller's fault
├── CommandRefused          the scanner does not know a command or one of its parameters: ILLEGAL REQUEST
├── ProfileMismatch         the command profile does not declare itself for the scanner that answered
└── NotTrusted              the command profile is in progress: it may only ask
DeviceError                 a fault of the scanner or of the scene
├── NotReady                warming up or otherwise unusable: NOT READY
│   └── BarrierClosed       the laser barrier covers the laser window
├── StillBusy               busy longer than any of its operations takes
├── PanelError              the front panel shows a message of the manual's list
├── NothingMeasured         the shot has not a single range sample
└── HardwareFault           HARDWARE ERROR, MEDIUM ERROR and other faults of its own
TransportError              a fault of the connection
├── Interrupted             an operation was lost: UNIT ATTENTION, ABORTED COMMAND, data of an earlier shot
├── BadReply                an invalid answer; of `drivers.scsi.errors`
└── DeadlineExceeded        a capture, or parking, took longer than it may

After Interrupted and BadReply the capture is repeated from its first command; after the others it is not.
"""

from __future__ import annotations

from drivers.scanner import DeviceError, SettingsError, TransportError


class CommandRefused(SettingsError):
    """Raised when the scanner refuses a command or a parameter as unknown to it."""


class ProfileMismatch(SettingsError):
    """The scanner is not one that the profile is for.

    Raised before any command of the profile is sent.
    """


class NotTrusted(SettingsError):
    """The profile is not trusted to write or to capture.

    Raised in place of such a command.
    """


class NotReady(DeviceError):
    """Raised when the scanner answers but cannot be used yet."""


class BarrierClosed(NotReady):
    """Raised when the laser barrier covers the laser window."""


class StillBusy(DeviceError):
    """Raised when the scanner stays busy longer than any of its operations takes."""


class PanelError(DeviceError):
    """Raised for a message of the front panel. `panel` is its text."""

    def __init__(self, panel: str, message: str, hint: str) -> None:
        super().__init__(message, hint)
        self.panel = panel


class NothingMeasured(DeviceError):
    """Raised when the range image of a capture is empty."""


class HardwareFault(DeviceError):
    """Raised when the scanner reports that a part of it has failed."""


class DeadlineExceeded(TransportError):
    """Raised when a capture, or parking, takes longer than it may. It is not repeated."""


class Interrupted(TransportError):
    """Raised when the scanner was reset, or lost the command it was doing."""

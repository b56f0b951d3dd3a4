"""The interface of every scanner, its settings, and its errors.

ScannerError            base class; carries the exit code (4) and a hint: what to do now
├── SettingsError       the caller's settings are outside what the scanner can do
├── DeviceError         the scanner reports a fault of its own
└── TransportError      the connection to the scanner failed
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Literal, Protocol, Self, runtime_checkable

if TYPE_CHECKING:  # the library takes seconds to import, and every command reports its errors by this module
    from restore.scan import RangeScan

Progress = Callable[[str, float], None]
"""Called with the name of the step and how much of it is done, 0 to 1."""

MIN_DISTANCE_MM, MAX_DISTANCE_MM = 500.0, 2500.0  # hardware manual p. 56, and the error "out of distance range"
MAX_LASER_POWER = 255
LASER_MAY_BE_ON = "the laser may be on: switch the scanner off"
"""The note of an error after which the laser could not be confirmed to be off."""
MAX_GAIN = 7
CAPTURE_S = (
    120.0  # deadline of a capture: a FINE shot takes 5 s, three attempts with their longest waits about a minute
)
MAX_DEADLINE_S = 3600.0
MAX_AVERAGE = 64  # four minutes of shots; noise is an eighth by then, and only systematic error remains


class ScannerError(Exception):
    """Base class of all scanner faults. `hint` says what to do now."""

    exit_code = 4

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class SettingsError(ScannerError):
    """Raised before anything is sent when a setting is outside what the scanner takes."""


class DeviceError(ScannerError):
    """Raised when the scanner reports a fault of its own."""


class TransportError(ScannerError):
    """Raised when the scanner cannot be reached or the connection to it breaks."""


@dataclass(frozen=True)
class CaptureSettings:
    """Settings of one capture.

    mode         "fine": 640×480 samples in 2.5 s; "fast": 320×240 samples in 0.3 s.
    distance_mm  distance from the front of the lens to the page, 500 to 2500; None uses autofocus.
    laser_power  1 to 255; None lets the scanner choose.
    gain         CCD gain, 0 to 7; None lets the scanner choose.
    average      shots to take of the same and average, 1 to 64: noise falls as 1/√average.
    deadline_s   time that the whole capture may take, 1 to 3600; None is CAPTURE_S, or more for many shots.
    multi_depth  take further shots focused nearer and farther where the page exceeds the depth window.

    >>> CaptureSettings(distance_mm=900).mode
    'fine'
    >>> CaptureSettings(distance_mm=90)
    Traceback (most recent call last):
        ...
    drivers.scanner.SettingsError: distance_mm = 90 is out of range
    """

    mode: Literal["fine", "fast"] = "fine"
    distance_mm: float | None = None
    laser_power: int | None = None
    gain: int | None = None
    average: int = 1
    multi_depth: bool = False
    deadline_s: float | None = None

    def __post_init__(self) -> None:
        if self.mode not in ("fine", "fast"):
            raise SettingsError(f"mode {self.mode!r} is not known", "use 'fine' or 'fast'")
        _check("distance_mm", self.distance_mm, MIN_DISTANCE_MM, MAX_DISTANCE_MM)
        _check("laser_power", self.laser_power, 1, MAX_LASER_POWER)
        _check("gain", self.gain, 0, MAX_GAIN)
        _check("average", self.average, 1, MAX_AVERAGE)
        _check("deadline_s", self.deadline_s, 1, MAX_DEADLINE_S)


def _check(name: str, value: float | None, low: float, high: float) -> None:
    if value is not None and not low <= value <= high:
        raise SettingsError(f"{name} = {value} is out of range", f"use a value from {low:g} to {high:g}")


class Scanner(Protocol):
    """A range scanner. Use it as a context manager: leaving switches the laser off."""

    def capture(self, settings: CaptureSettings, progress: Progress = ...) -> RangeScan:
        """Shoot once and return the range grid with its colour image."""
        ...

    def close(self) -> None:
        """Switch the laser off and close the device. Safe to call twice."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


@runtime_checkable
class Turner(Protocol):
    """Turns leaves: of a scanner with a robot. Without one the operator turns them."""

    def turn_to(self, opening: int, attempt: int) -> None:
        """Turn the leaves until an opening of the volume is before the scanner.

        Nothing is turned where it is already.
        opening: counted from 0.
        attempt: how often it was captured before.
        Raises ScannerError.
        """
        ...

"""The interface of every scanner, its settings, and its errors.

ScannerError            base class; carries the exit code (4) and a hint: what to do now
├── SettingsError       the caller's settings are outside what the scanner can do
├── DeviceError         the scanner reports a fault of its own
└── TransportError      the connection to the scanner failed
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from math import inf
from pathlib import Path
from shutil import rmtree
from types import TracebackType
from typing import (
    TYPE_CHECKING,
    Any,
    NamedTuple,
    Protocol,
    Self,
    TypeAlias,
    get_args,
    get_type_hints,
    runtime_checkable,
)

if TYPE_CHECKING:  # the library takes seconds to import, and every command reports its errors by this module
    from restore.scan import RangeScan

Progress = Callable[[str, float], None]
"""Called with the name of the step and how much of it is done, 0 to 1."""

LASER_MAY_BE_ON = "the laser may be on: switch the scanner off"
"""The note of an error after which the laser could not be confirmed to be off."""
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


class Setting(NamedTuple):
    """One setting of a capture, as its class declares it.

    text, unit  what it is, for the operator.
    kind        "flag", "integer", "number", or "choice", one of the choices.
    low, high   limits, both possible; None for none.
    optional    whether None is a value.
    """

    name: str
    default: Any
    text: str
    unit: str
    low: float | None
    high: float | None
    kind: str
    choices: tuple[str, ...]
    optional: bool

    def check(self, value: Any) -> None:
        """Raise SettingsError for a value of another kind or beyond the limits."""
        if value is None and self.optional:
            return
        if self.kind == "choice" and value not in self.choices:
            raise SettingsError(f"{self.name}: {value!r} is not usable", f"use one of: {', '.join(self.choices)}")
        if not isinstance(value, KINDS[self.kind]) or (isinstance(value, bool) and self.kind != "flag"):
            raise SettingsError(f"{self.name}: {value!r} is not usable", f"it has to be of the kind {self.kind}")
        low, high = -inf if self.low is None else self.low, inf if self.high is None else self.high
        if isinstance(value, int | float) and not low <= value <= high:
            raise SettingsError(f"{self.name} = {value} is out of range", f"use a value from {low:g} to {high:g}")


KINDS: Mapping[str, type | tuple[type, ...]] = {"flag": bool, "integer": int, "number": (int, float), "choice": str}


def setting(default: Any, text: str, *, unit: str = "", low: float | None = None, high: float | None = None) -> Any:
    """Return a field of a class of settings; its annotation gives kind and choices."""
    return field(default=default, metadata={"text": text, "unit": unit, "low": low, "high": high})


@dataclass(frozen=True, kw_only=True)
class CaptureSettings:
    """Settings of a capture by any scanner; a driver's own class adds more by `setting`.

    average     shots to take of the same and average: noise falls as 1/√average.
    deadline_s  time that the whole capture may take.

    >>> CaptureSettings(average=90)
    Traceback (most recent call last):
        ...
    drivers.scanner.SettingsError: average = 90 is out of range
    """

    average: int = setting(1, "captures that are averaged", low=1, high=MAX_AVERAGE)
    deadline_s: float | None = setting(
        None, "time that a capture may take; empty: the scanner's own", unit="s", low=1, high=MAX_DEADLINE_S
    )

    def __post_init__(self) -> None:
        for one in self.declared():
            one.check(getattr(self, one.name))

    @classmethod
    def declared(cls) -> tuple[Setting, ...]:
        """The settings in the order of a form: a driver's own first."""
        hints, found = get_type_hints(cls), []
        for one in fields(cls):
            options = [kind for kind in get_args(hints[one.name]) if kind is not type(None)]
            optional = type(None) in get_args(hints[one.name])
            annotation = options[0] if optional else hints[one.name]
            choices = get_args(annotation)
            kind = "choice" if choices else {bool: "flag", int: "integer", float: "number"}[annotation]
            facts = {"kind": kind, "choices": choices, "optional": optional, **one.metadata}
            found.append(Setting(name=one.name, default=one.default, **facts))
        common = {one.name for one in fields(CaptureSettings)}
        return tuple(sorted(found, key=lambda one: one.name in common))

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> Self:
        """Return the settings of a table. Raises SettingsError, also for an unknown name."""
        known = [one.name for one in cls.declared()]
        for name in values:
            if name not in known:
                raise SettingsError(f"{name}: is not a known setting", f"use one of: {', '.join(known)}")
        return cls(**values)

    def preview(self) -> Self:
        """Return the settings of one quick shot of the same."""
        return replace(self, average=1)


@dataclass(frozen=True)
class ScanFile:
    """A scan that the scanner's own program wrote. It is stored as it came, then read.

    path        the file; the files that it names lie next to it.
    reading     unit, grid and depth of it, as for `load_scan`.
    provenance  facts that the file does not hold.
    folder      made for this shot alone; None where the files stay.
    """

    path: Path
    reading: Mapping[str, str] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)
    folder: Path | None = None

    def discard(self) -> None:
        """Remove the folder of the shot: the scan is stored, or was only looked at."""
        if self.folder is not None:
            rmtree(self.folder, ignore_errors=True)


Shot: TypeAlias = "RangeScan | ScanFile"


class Scanner(Protocol):
    """A range scanner. Use it as a context manager: leaving switches the laser off."""

    def capture(self, settings: CaptureSettings, progress: Progress = ...) -> Shot:
        """Shoot once; return the range grid with its colours, or the file that has them."""
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


@runtime_checkable
class SelfTriggered(Protocol):
    """Captures without a key: of a scanner that is triggered by hand."""

    def wait(self, seconds: float) -> bool:
        """Wait for a shot no longer than some seconds; return whether one is there.

        It may be called from any thread.
        """
        ...

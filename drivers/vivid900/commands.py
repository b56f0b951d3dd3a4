"""Every command of a profile, built and parsed; the names follow the calls of the vendor's development kit.

The host builds a Command and parses the reply; a device (the simulated one) parses the CDB and builds the reply.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Literal, TypeVar

from drivers.scanner import MAX_DISTANCE_MM, MAX_GAIN, MAX_LASER_POWER, MIN_DISTANCE_MM, SettingsError
from drivers.vivid900.errors import BadReply
from drivers.vivid900.profile import Profile

Direction = Literal["none", "in", "out"]
Name = TypeVar("Name", bound=str)
State = Literal["warming-up", "barrier-closed", "ready", "busy", "data"]
Focus = Literal["passive", "active"]

MAX_THRESHOLD, AUTO_THRESHOLD = 1023, 65535  # of the ten-bit converter
AUTO_COLOUR = 10  # 0 to 9 are the levels of the panel's menu COLOR


class ShotMode(IntEnum):
    """What one release records (`r_mode` of the development kit)."""

    FINE_COLOUR = 0
    FAST_COLOUR = 1
    COLOUR_8 = 2
    COLOUR_10 = 3
    MONITOR = 4
    RED = 5
    GREEN = 6
    BLUE = 7

    @property
    def has_range(self) -> bool:
        """Whether the shot has a range image: the laser sweeps."""
        return self <= ShotMode.FAST_COLOUR


@dataclass(frozen=True)
class Parameters:
    """The camera-mode block. Raises SettingsError for a value out of its range.

    distance_mm  focus and middle of the depth window, from the front of the lens, 500 to 2500.
    laser_power  0 to 255, 0 is off; gain: 0 to 7.
    threshold    least brightness of a sample, 0 to 1023, 65535 lets the scanner choose.
    auto_read    0: the range image is followed by colour; 1: range image only.
    colour       colour exposure level, 0 to 9, 10 lets the scanner choose.
    """

    distance_mm: int = 1000
    laser_power: int = 0
    gain: int = 0
    mode: ShotMode = ShotMode.FINE_COLOUR
    threshold: int = AUTO_THRESHOLD
    auto_read: int = 0
    colour: int = AUTO_COLOUR

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            value: int = getattr(self, name)
            if not low <= value <= high and (name, value) != ("threshold", AUTO_THRESHOLD):
                raise SettingsError(f"{name} = {value} is out of range", f"use a value from {low} to {high}")
        object.__setattr__(self, "mode", ShotMode(self.mode))


RANGES: Mapping[str, tuple[int, int]] = {
    "distance_mm": (int(MIN_DISTANCE_MM), int(MAX_DISTANCE_MM)),
    "laser_power": (0, MAX_LASER_POWER),
    "gain": (0, MAX_GAIN),
    "mode": (0, max(ShotMode)),
    "threshold": (0, MAX_THRESHOLD),
    "auto_read": (0, 1),
    "colour": (0, AUTO_COLOUR),
}


@dataclass(frozen=True)
class Status:
    """State of the scanner.

    panel        message that the last operation left on the front panel, empty when it succeeded.
    lens         name of the mounted lens; lens_serial, body_serial: calibrations are made for such a pair.
    shot         counts releases since power-on; focused counts autofocuses, where the profile has such a field.
    """

    state: State
    lens: str
    lens_serial: int = 0
    body_serial: int = 0
    shot: int = 0
    focused: int = 0
    panel: str = ""


@dataclass(frozen=True)
class Command:
    """One command as a transport takes it; `name` and `values` say what it means."""

    name: str
    cdb: bytes
    data_out: bytes = b""
    data_in_length: int = 0
    values: Mapping[str, int] = field(default_factory=dict)


def read_parameters(profile: Profile) -> Command:
    """Ask for the parameter block."""
    return _reading(profile, "read_parameters", length=profile.blocks.parameters.length)


def status(profile: Profile) -> Command:
    """Ask for the status block."""
    return _reading(profile, "status", length=profile.blocks.status.length)


def write_parameters(profile: Profile, block: bytes) -> Command:
    """Write a parameter block."""
    values = {"length": len(block)}
    return Command("write_parameters", profile.commands.write_parameters.build(**values), block, 0, values)


def autofocus(profile: Profile, kind: Focus) -> Command:
    """Focus by contrast (passive: sets the distance) or by laser (active: sets distance and laser power)."""
    name = f"{kind}_autofocus"
    return Command(name, profile.commands.by_name[name].build())


def release(profile: Profile) -> Command:
    """Take the shot."""
    return Command("release", profile.commands.release.build())


def read_pitch(profile: Profile, offset: int, length: int) -> Command:
    """Ask for bytes of the range image, header first."""
    return _reading(profile, "read_pitch", offset=offset, length=length)


def read_colour(profile: Profile, mode: ShotMode, offset: int, length: int) -> Command:
    """Ask for bytes of the colour image that a shot of this mode left, header first."""
    return _reading(profile, "read_colour", offset=offset, length=length, kind=mode)


def _reading(profile: Profile, name: str, **values: int) -> Command:
    layout = profile.commands.by_name[name]
    kept = {key: int(value) for key, value in values.items() if key in layout.fields}
    return Command(name, layout.build(**kept), b"", values["length"], kept)


def parse_command(profile: Profile, cdb: bytes) -> tuple[str, dict[str, int]] | None:
    """Name and fields of a command of the profile, None when the bytes are no command of it."""
    for name, layout in profile.commands.by_name.items():
        values = layout.parse(cdb)
        if values is not None:
            return name, values
    return None


def build_parameters(profile: Profile, parameters: Parameters, *, base: bytes | None = None) -> bytes:
    """The parameter block. base: the scanner's present block, whose bytes without a field are kept."""
    values = {item.name: int(getattr(parameters, item.name)) for item in fields(parameters)}
    return profile.blocks.parameters.build(values, base=base)


def without_laser(profile: Profile, block: bytes) -> bytes:
    """A parameter block with the laser power 0 and all else as it is. Raises BadReply for a damaged block."""
    values = profile.blocks.parameters.parse(block)
    return profile.blocks.parameters.build({**values, "laser_power": 0}, base=block)


def parse_parameters(profile: Profile, data: bytes) -> Parameters:
    """Read the parameter block. Raises BadReply, also for values that no scanner can have."""
    values = profile.blocks.parameters.parse(data)
    try:
        return Parameters(**{name: values[name] for name in RANGES})  # type: ignore[arg-type]
    except SettingsError as error:
        raise BadReply(f"the scanner's parameters make no sense: {error}") from error


def build_status(profile: Profile, status: Status) -> bytes:
    """The status block. Raises SettingsError for a message or lens that the profile does not have."""
    panels = {"": 0, **profile.panels}
    if status.panel not in panels or status.lens not in profile.lenses or status.state not in profile.states:
        raise SettingsError(f"the profile has no bytes for {status}")
    values = {
        "state": profile.states[status.state],
        "panel": panels[status.panel],
        "lens": profile.lenses[status.lens],
        **{name: getattr(status, name) for name in ("shot", "focused", "lens_serial", "body_serial")},
    }
    return profile.blocks.status.build(values)


def parse_status(profile: Profile, data: bytes) -> Status:
    """Read the status block. Raises BadReply, also for a state, message or lens that the profile does not have."""
    values = profile.blocks.status.parse(data)
    numbers = {name: values.get(name, 0) for name in ("lens_serial", "body_serial", "shot", "focused")}
    return Status(
        state=_name_of(profile.states, values["state"], "state"),
        lens=_name_of(profile.lenses, values["lens"], "lens"),
        panel=_name_of({"": 0, **profile.panels}, values["panel"], "panel"),
        **numbers,
    )


def _name_of(table: Mapping[Name, int], value: int, what: str) -> Name:
    for name, number in table.items():
        if number == value:
            return name
    raise BadReply(f"the scanner is in {what} {value}, which the profile does not have")

"""Every command of a profile, built and parsed.

The names follow the calls of the vendor's development kit.
The host builds a Command and parses the reply; a device (the simulated one) parses the CDB and builds the reply.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Any, Literal

from drivers.scanner import SettingsError
from drivers.scsi.errors import BadReply
from drivers.vivid900.profile.contents import CommandName
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.settings import MAX_DISTANCE_MM, MAX_GAIN, MAX_LASER_POWER, MIN_DISTANCE_MM

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
    lens         name of the mounted lens; lens_serial, body_serial: calibrations are made for such a pair. Empty and 0
                 when they are not reported.
    shot         counts releases since power-on; focused counts autofocuses, where the profile has such a field.
    """

    state: State
    lens: str = ""
    lens_serial: int = 0
    body_serial: int = 0
    shot: int = 0
    focused: int = 0
    panel: str = ""


STATUS_FIELDS = frozenset(field.name for field in fields(Status))


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
    return _command(profile, "read_parameters", data_in=profile.blocks.parameters.length)


def status(profile: Profile) -> Command:
    """Ask for the status block."""
    return _command(profile, "status", data_in=profile.blocks.status.length)


def write_parameters(profile: Profile, block: bytes) -> Command:
    """Write a parameter block."""
    return _command(profile, "write_parameters", values={"length": len(block)}, data_out=block)


def autofocus(profile: Profile, kind: Focus) -> Command:
    """Focus by contrast (passive) or by laser (active).

    Passive sets the distance, active the distance and the laser power.
    """
    return _command(profile, "passive_autofocus" if kind == "passive" else "active_autofocus")


def release(profile: Profile, parameters: Parameters | None = None) -> Command:
    """Take the shot; some scanners take parameters with it."""
    return _command(profile, "release", values=_wire_values(profile, parameters or Parameters()))


def read_pitch(profile: Profile, offset: int, length: int) -> Command:
    """Ask for bytes of the range image, header first."""
    return _command(profile, "read_pitch", values={"offset": offset}, data_in=length)


def read_colour(profile: Profile, mode: ShotMode, offset: int, length: int) -> Command:
    """Ask for bytes of the colour image that a shot of this mode left, header first."""
    return _command(
        profile, "read_colour", values={"offset": offset, "kind": _wire_mode(profile, mode)}, data_in=length
    )


def _command(
    profile: Profile,
    name: CommandName,
    *,
    values: Mapping[str, int] | None = None,
    data_in: int = 0,
    data_out: bytes | None = None,
) -> Command:
    """Build a command from its templates.

    Raises SettingsError when the profile does not have it.
    """
    if name not in profile.commands:
        raise SettingsError(
            f"the command profile {profile.name!r} has no {name}", "see what `planish query` prints of it"
        )
    written = profile.commands[name]
    kept = {key: value for key, value in {"length": data_in, **(values or {})}.items() if key in written.fields}
    sent = written.out.build(kept) if data_out is None else data_out
    return Command(name, written.cdb.build(kept), sent, data_in, kept)


def parse_command(profile: Profile, cdb: bytes, data_out: bytes = b"") -> tuple[str, dict[str, int]] | None:
    """Return name and fields of a command, those of its data included.

    Returns None for bytes that are not a command of the profile.
    """
    for name, command in profile.commands.items():
        values = command.cdb.match(cdb)
        if values is not None:
            return name, values | (command.out.match(data_out) or {})
    return None


def build_parameters(profile: Profile, parameters: Parameters, *, base: bytes | None = None) -> bytes:
    """Build the parameter block.

    base: the scanner's present block; its bytes without a field are kept.
    """
    return profile.blocks.parameters.build(_wire_values(profile, parameters), base=base)


def without_laser(profile: Profile, block: bytes) -> bytes:
    """Return a parameter block with laser power 0 and all else as it is.

    Raises BadReply for a damaged block.
    """
    profile.blocks.parameters.parse(block)
    return profile.blocks.parameters.build({"laser_power": 0}, base=block)


def parse_parameters(profile: Profile, data: bytes) -> Parameters:
    """Read the parameter block; what it does not have is as in `Parameters`.

    Raises BadReply, also for values that no scanner can have.
    """
    return parameters_of(profile, profile.blocks.parameters.parse(data))


def parameters_of(profile: Profile, values: Mapping[str, int]) -> Parameters:
    """Return the parameters in the values of a block or of a release.

    Raises BadReply for values that no scanner can have.
    """
    known = {name: values[name] for name in RANGES if name in values}
    if "mode" in known:
        modes = {name: _wire_mode(profile, mode) for name, mode in ShotMode.__members__.items() if _has(profile, mode)}
        known["mode"] = ShotMode[_name_of(modes, known["mode"], "mode")]
    try:
        return Parameters(**known)  # type: ignore[arg-type]
    except SettingsError as error:
        raise BadReply(f"the scanner's parameters make no sense: {error}") from error


def _wire_values(profile: Profile, parameters: Parameters) -> dict[str, int]:
    values = {item.name: int(getattr(parameters, item.name)) for item in fields(parameters)}
    return {**values, "mode": _wire_mode(profile, parameters.mode)}


def _has(profile: Profile, mode: ShotMode) -> bool:
    return not profile.modes or mode.name in profile.modes


def _wire_mode(profile: Profile, mode: ShotMode) -> int:
    """Return the scanner's number of a mode.

    Raises SettingsError when the profile does not have it.
    """
    if not _has(profile, mode):
        hint = f"it has {', '.join(profile.modes)}"
        raise SettingsError(f"the command profile {profile.name!r} has no mode {mode.name}", hint)
    return profile.modes.get(mode.name, int(mode))


def build_status(profile: Profile, status: Status) -> bytes:
    """Build the status block.

    Raises SettingsError for a message or lens that the profile does not have.
    """
    values = {name: getattr(status, name) for name in ("shot", "focused", "lens_serial", "body_serial")}
    for name, table in _status_tables(profile).items():
        text = getattr(status, name)
        if text not in table:
            raise SettingsError(f"the profile has no bytes for {status}")
        values[name] = table[text]
    return profile.blocks.status.build(values)


def parse_status(profile: Profile, data: bytes) -> Status:
    """Parse the status block.

    Raises BadReply, also for a state, message or lens that the profile does not have.
    """
    values: dict[str, Any] = profile.blocks.status.parse(data)
    names = {name: _name_of(table, values[name], name) for name, table in _status_tables(profile).items()}
    return Status(**{name: value for name, value in (values | names).items() if name in STATUS_FIELDS})


def _status_tables(profile: Profile) -> dict[str, Mapping[str, int]]:
    """Field of the status block → its table, for the fields that the block has."""
    tables = {"state": profile.states, "lens": profile.lenses, "panel": {"": 0, **profile.panels}}
    return {name: table for name, table in tables.items() if name in profile.blocks.status.fields}


def _name_of(table: Mapping[str, int], value: int, what: str) -> str:
    for name, number in table.items():
        if number == value:
            return name
    raise BadReply(f"the scanner is in {what} {value}, which the profile does not have")

"""A command profile: the bytes of every command and block of a scanner's firmware, read from a TOML file.

The vendor never published the commands of the Vivid 900. What the driver sends beyond the three commands of the
standard comes from a profile that names the firmware it is for; see `configs/profiles/`.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from drivers.scanner import SettingsError
from drivers.shipped import CONFIGS
from drivers.vivid900.blocks import Block
from drivers.vivid900.cdb import Layout
from drivers.vivid900.errors import ProfileMismatch
from drivers.vivid900.scsi import Identity
from restore.files import read_toml

PROFILES = CONFIGS / "profiles"
SIMULATED = "planish-simulated-0"

# Which fields a command may say, and which it must.
_FIELDS: dict[str, tuple[frozenset[str], frozenset[str]]] = {
    "read_parameters": (frozenset({"length"}), frozenset()),
    "write_parameters": (frozenset({"length"}), frozenset()),
    "passive_autofocus": (frozenset(), frozenset()),
    "active_autofocus": (frozenset(), frozenset()),
    "release": (frozenset(), frozenset()),
    "status": (frozenset({"length"}), frozenset()),
    "read_pitch": (frozenset({"offset", "length"}), frozenset({"offset", "length"})),
    "read_colour": (frozenset({"offset", "length", "kind"}), frozenset({"offset", "length"})),
}

Assurance = Literal["checksummed", "doubled", "single"]
_Layout = Annotated[Layout, BeforeValidator(lambda text: Layout.read(text) if isinstance(text, str) else text)]
_Model = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class Firmware(BaseModel):
    """The scanners that a profile is for, by their INQUIRY data; revisions may have the wildcards * and ?."""

    model_config = _Model
    vendor: str
    product: str
    revisions: Annotated[tuple[str, ...], Field(min_length=1)]

    def fits(self, identity: Identity) -> bool:
        """Whether a scanner is one of them."""
        named = (identity.vendor, identity.product) == (self.vendor, self.product)
        return named and any(fnmatchcase(identity.revision, revision) for revision in self.revisions)


class Commands(BaseModel):
    """The CDB of every command."""

    model_config = _Model
    read_parameters: _Layout
    write_parameters: _Layout
    passive_autofocus: _Layout
    active_autofocus: _Layout
    release: _Layout
    status: _Layout
    read_pitch: _Layout
    read_colour: _Layout

    @cached_property
    def by_name(self) -> dict[str, Layout]:
        """Name → layout."""
        return {name: getattr(self, name) for name in _FIELDS}

    @model_validator(mode="after")
    def _have_their_fields(self) -> Self:
        for name, (may, must) in _FIELDS.items():
            has = self.by_name[name].fields
            if not must <= has.keys() <= may:
                raise ValueError(
                    f"{name} has the fields {sorted(has)}, must have {sorted(must)}, may have {sorted(may)}"
                )
        return self


class Blocks(BaseModel):
    """The blocks of fields, and the headers before the images."""

    model_config = _Model
    parameters: Block
    status: Block
    pitch: Block
    colour: Block

    @model_validator(mode="after")
    def _have_their_fields(self) -> Self:
        for name, must in _BLOCK_FIELDS.items():
            lacking = must - getattr(self, name).fields.keys()
            if lacking:
                raise ValueError(f"{name} lacks the fields {sorted(lacking)}")
        return self


_BLOCK_FIELDS = {
    "parameters": {"distance_mm", "laser_power", "gain", "mode", "threshold", "auto_read", "colour"},
    "status": {"state", "shot", "panel", "lens", "lens_serial", "body_serial"},
    "pitch": {"shot", "rows", "cols"},
    "colour": {"shot", "rows", "cols"},
}


class PitchEncoding(BaseModel):
    """A sample of the range image.

    pixel  its integers in their order, each u1, u2 or u4. `sum` Σx and `moment` Σ(i·x) over the frames i give the
           temporal barycentre (US 6,151,118); `intensity` is the brightest x.
    """

    model_config = _Model
    encoding: Literal["barycentre"] = "barycentre"
    order: Literal["big", "little"] = "big"
    pixel: tuple[tuple[Literal["sum", "moment", "intensity"], Literal["u1", "u2", "u4"]], ...]

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        names = [name for name, _ in self.pixel]
        if sorted(names) != ["intensity", "moment", "sum"]:
            raise ValueError("a pixel has sum, moment and intensity, each once")
        return self


class ColourEncoding(BaseModel):
    """A pixel of the colour image: its channels in their order, side by side or plane after plane."""

    model_config = _Model
    layout: Literal["interleaved", "planar"] = "interleaved"
    channels: Annotated[str, Field(pattern="^(RGB|BGR|GRB|RBG|GBR|BRG)$")] = "RGB"
    order: Literal["big", "little"] = "big"


class Profile(BaseModel):
    """All that the driver needs to talk to one kind of scanner.

    chunk_bytes  most bytes that one reading command asks for.
    reads_once   whether an image can be read only once after its shot; matters only for blocks without checksums.
    states       wire value → state; panels: wire value of the status block → text of the panel, 0 is no message.
    lenses       wire value → name of the lens.
    sense        "code/qualifier" of the vendor, in hexadecimal → text of the panel.
    """

    model_config = _Model
    name: Annotated[str, Field(min_length=1)]
    about: str = ""
    firmware: Firmware
    chunk_bytes: Annotated[int, Field(ge=512, le=1 << 24)] = 32768
    reads_once: bool = False
    commands: Commands
    blocks: Blocks
    pitch: PitchEncoding
    colour: ColourEncoding = ColourEncoding()
    states: dict[Literal["warming-up", "barrier-closed", "ready", "busy", "data"], int]
    lenses: dict[Literal["TELE", "MIDDLE", "WIDE"], int]
    panels: dict[str, int] = {}
    sense: dict[str, str] = {}

    @model_validator(mode="after")
    def _can_be_told_apart(self) -> Self:
        layouts = list(self.commands.by_name.items())
        for index, (name, layout) in enumerate(layouts):
            twins = [other for other, twin in layouts[index + 1 :] if layout.overlaps(twin)]
            if twins:
                raise ValueError(f"{name} and {twins[0]} can be the same bytes")
        for table in (self.states, self.lenses, self.panels):
            if len(set(table.values())) < len(table):
                raise ValueError(f"two of {', '.join(table)} have the same value")
        self.panel_by_sense  # noqa: B018 - raises for a code that is none
        return self

    @property
    def assurance(self) -> Assurance:
        """How damage in transfer is detected: by checksums, by reading images twice, or not at all."""
        images = self.blocks.pitch, self.blocks.colour
        if all(block.crc32 is not None for block in images):
            return "checksummed"
        return "single" if self.reads_once else "doubled"

    @cached_property
    def panel_by_sense(self) -> dict[tuple[int, int], str]:
        """(code, qualifier) → text of the panel. Raises ValueError for a key that is not two bytes."""
        pairs = {tuple(bytes.fromhex(key.replace("/", " "))): text for key, text in self.sense.items()}
        if any(len(pair) != 2 for pair in pairs):
            raise ValueError("a sense code is written code/qualifier, like 80/01")
        return {(pair[0], pair[1]): text for pair, text in pairs.items()}

    def require(self, identity: Identity) -> None:
        """Raise ProfileMismatch unless the profile declares itself for the scanner that answered."""
        if not self.firmware.fits(identity):
            mine = f"{self.firmware.vendor} {self.firmware.product} {' or '.join(self.firmware.revisions)}"
            raise ProfileMismatch(
                f"the command profile {self.name!r} is for {mine}, and the scanner is {identity}",
                "name a profile that was made for this firmware; docs/operators-guide.md tells how to get one",
            )


def load_profile(name: str | Path) -> Profile:
    """Read a profile: a file, or one of `configs/profiles` by its name. Raises SettingsError."""
    path = Path(name)
    if path.suffix != ".toml":
        path = PROFILES / f"{name}.toml"
    try:
        return parse_profile(read_toml(path), where=str(path))
    except OSError as error:
        hint = "name a file that ends in .toml, or a profile of configs/profiles"
        raise SettingsError(f"cannot read the command profile {path}: {error.strerror}", hint) from error
    except ValueError as error:  # TOMLDecodeError, UnicodeDecodeError
        raise SettingsError(f"{path} is not a TOML file: {error}", f"compare it with {PROFILES}") from error


def parse_profile(table: dict[str, Any], *, where: str = "profile") -> Profile:
    """Check the table of a profile. Raises SettingsError that names the key."""
    try:
        return Profile.model_validate(table)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        raise SettingsError(f"{where}: {key}: {first['msg']}", f"compare it with {PROFILES}") from error

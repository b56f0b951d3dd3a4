"""Command profile: commands, blocks and images of a firmware, from TOML.

The vendor never published the commands of the Vivid 900. What the driver sends beyond the three commands of the
standard comes from a profile that names the firmware it is for; see `configs/profiles/`.
"""

from __future__ import annotations

from fnmatch import fnmatchcase
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drivers.scanner import SettingsError
from drivers.scsi.commands import STANDARD, Identity
from drivers.shipped import CONFIGS
from drivers.vivid900.errors import NotTrusted, ProfileMismatch
from drivers.vivid900.profile.contents import COMMAND_FIELDS, CONSEQUENCES, REQUIRED, STATUS_REQUIRED, CommandName
from drivers.vivid900.profile.encodings import ColourEncoding, PitchEncoding
from drivers.vivid900.profile.template import Template
from restore.files import read_toml

PROFILES = CONFIGS / "profiles"
SIMULATED = "planish-simulated-0"

CDB_LENGTHS = range(6, 17)  # six bytes are the shortest; sixteen the longest that USB bridges and SG_IO both carry
Mode = Annotated[str, Field(pattern="^(FINE_COLOUR|FAST_COLOUR|COLOUR_8|COLOUR_10|MONITOR|RED|GREEN|BLUE)$")]
State = Annotated[str, Field(pattern="^(warming-up|barrier-closed|ready|busy|data)$")]
LensName = Annotated[str, Field(pattern="^(TELE|MIDDLE|WIDE)$")]
Integrity = Literal["checksum", "read_twice", "read_once"]

_Model = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class Firmware(BaseModel):
    """The scanners that a profile is for, by their INQUIRY data.

    Revisions may have the wildcards * and ?.
    """

    model_config = _Model
    vendor: str
    product: str
    revisions: Annotated[tuple[str, ...], Field(min_length=1)]

    def fits(self, identity: Identity) -> bool:
        """Whether a scanner is one of them."""
        named = (identity.vendor, identity.product) == (self.vendor, self.product)
        return named and any(fnmatchcase(identity.revision, revision) for revision in self.revisions)


class CommandBytes(BaseModel):
    """A command: its CDB, and the data sent with it unless that is a block."""

    model_config = _Model
    cdb: Template
    out: Template = Template(constants=b"")

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, table: Any) -> Any:
        return {"cdb": table} if isinstance(table, str) else table

    @model_validator(mode="after")
    def _is_a_cdb(self) -> Self:
        if self.cdb.length not in CDB_LENGTHS:
            raise ValueError(f"a CDB of {self.cdb.length} bytes, {CDB_LENGTHS.start} to {CDB_LENGTHS.stop - 1} can be")
        if self.cdb.constants is None or any(span.at == 0 for span in self.cdb.fields.values()):
            raise ValueError("a CDB is written as text, and its first byte is fixed")
        if self.cdb.constants[0] in STANDARD:
            raise ValueError(f"{self.cdb.constants[0]:02X}h is a command of every SCSI device, and no scanner's own")
        return self

    @property
    def opcode(self) -> int:
        """The first byte."""
        return (self.cdb.constants or b"\0")[0]

    @property
    def fields(self) -> frozenset[str]:
        """Names of the fields of both."""
        return frozenset(self.cdb.fields) | frozenset(self.out.fields)


class Blocks(BaseModel):
    """Blocks of parameters and status, and image headers, empty where absent."""

    model_config = _Model
    parameters: Template = Template()
    status: Template = Template()
    pitch: Template = Template()
    colour: Template = Template()


class Profile(BaseModel):
    """All that the driver needs to talk to one kind of scanner.

    trusted      whether its owner lets the driver write and shoot; until then it only asks.
    chunk_bytes  most bytes that one reading command asks for.
    reads_once   whether an image can be read only once after its shot; matters only for images without checksums.
    modes        name of a shot's mode → wire value, that of the development kit by default.
    states       name of a state → wire value; panels: text of the panel → wire value of the status block, 0 is no
                 message; lenses: name of the lens → wire value.
    sense        "code/qualifier" of the vendor, in hexadecimal → text of the panel.
    """

    model_config = _Model
    name: Annotated[str, Field(min_length=1)]
    about: str = ""
    firmware: Firmware
    trusted: bool = False
    chunk_bytes: Annotated[int, Field(ge=512, le=1 << 24)] = 32768
    reads_once: bool = False
    commands: dict[CommandName, CommandBytes] = {}
    blocks: Blocks = Blocks()
    pitch: PitchEncoding = PitchEncoding()
    colour: ColourEncoding = ColourEncoding()
    modes: dict[Mode, int] = {}
    states: dict[State, int] = {}
    lenses: dict[LensName, int] = {}
    panels: dict[str, int] = {}
    sense: dict[str, str] = {}

    @model_validator(mode="after")
    def _is_unambiguous(self) -> Self:
        for (name, one), (twin, other) in combinations(self.commands.items(), 2):
            if one.cdb.overlaps(other.cdb):
                raise ValueError(f"{name} and {twin} can be the same bytes")
        for table in (self.modes, self.states, self.lenses, self.panels):
            if len(set(table.values())) < len(table):
                raise ValueError(f"two of {', '.join(table)} have the same value")
        self.panel_by_sense  # noqa: B018 - raises for an invalid code
        return self

    @model_validator(mode="after")
    def _has_what_it_needs(self) -> Self:
        for name, command in self.commands.items():
            if not command.fields <= COMMAND_FIELDS[name]:
                has, may = sorted(command.fields), sorted(COMMAND_FIELDS[name])
                raise ValueError(f"commands.{name} has the fields {has}, may have {may}")
        if self.trusted and self.lacking:
            raise ValueError(f"a trusted profile needs {', '.join(self.lacking)}")
        return self

    @property
    def _names(self) -> set[str]:
        """Everything that the profile has, by its place in the file."""
        blocks = {name: getattr(self.blocks, name) for name in Blocks.model_fields}
        names = {f"commands.{name}" for name in self.commands} | {f"states.{name}" for name in self.states}
        names |= {f"blocks.{name}.{field}" for name, block in blocks.items() for field in block.fields}
        names |= {f"blocks.{name}.checksum" for name, block in blocks.items() if block.is_checked}
        names |= {f"pitch.{name}" for name, _ in self.pitch.pixel} | ({"pitch.pixel"} if self.pitch.pixel else set())
        modes = {"blocks.parameters.mode"} & names or "mode" in self.fields_of("release")
        return names | ({"mode"} if modes else set())

    def fields_of(self, command: CommandName) -> frozenset[str]:
        """Names of a command's fields; none when the profile does not have it."""
        return self.commands[command].fields if command in self.commands else frozenset()

    @property
    def lacking(self) -> list[str]:
        """What has to be found out before the profile can be trusted."""
        needed = REQUIRED + (STATUS_REQUIRED if "status" in self.commands else ())
        return [name for name in needed if name not in self._names]

    @property
    def absences(self) -> dict[str, str]:
        """What the profile does without → the consequence."""
        names = self._names
        unasked = {"commands.status": "blocks.status.", "commands.read_colour": "blocks.colour."}
        prefixes = tuple(prefix for command, prefix in unasked.items() if command not in names)
        return {
            name: text
            for name, text in CONSEQUENCES.items()
            if name not in names and not (prefixes and name.startswith(prefixes))
        }

    @property
    def integrity(self) -> Integrity:
        """Return how transfer damage is detected: checksums, reading twice, or not at all."""
        images = [self.blocks.pitch, *([self.blocks.colour] if "read_colour" in self.commands else [])]
        if all(block.is_checked for block in images):
            return "checksum"
        return "read_once" if self.reads_once else "read_twice"

    @cached_property
    def panel_by_sense(self) -> dict[tuple[int, int], str]:
        """Return the text of the panel by (code, qualifier).

        Raises ValueError for a key that is not two bytes.
        """
        pairs = {tuple(bytes.fromhex(key.replace("/", " "))): text for key, text in self.sense.items()}
        if any(len(pair) != 2 for pair in pairs):
            raise ValueError("a sense code is written code/qualifier, like 80/01")
        return {(pair[0], pair[1]): text for pair, text in pairs.items()}

    def require(self, identity: Identity) -> None:
        """Raise ProfileMismatch unless the profile is for this scanner."""
        if not self.firmware.fits(identity):
            mine = f"{self.firmware.vendor} {self.firmware.product} {' or '.join(self.firmware.revisions)}"
            raise ProfileMismatch(
                f"the command profile {self.name!r} is for {mine}, and the scanner is {identity}",
                "name a profile that was made for this firmware: see docs/how-to/connect-a-vivid-900.md",
            )

    def require_trust(self, what: str) -> None:
        """Raise NotTrusted unless the profile's owner lets the driver write and shoot."""
        if not self.trusted:
            raise NotTrusted(
                f"the command profile {self.name!r} is not trusted yet: {what} is not sent",
                "compare the answers of `planish query` with the scanner's panel, then set trusted = true in it",
            )


def load_profile(name: str | Path) -> Profile:
    """Read a profile: a file, or one of `configs/profiles` by its name.

    Raises SettingsError.
    """
    path = Path(name)
    if path.suffix != ".toml":
        path = PROFILES / f"{name}.toml"
    try:
        return parse_profile(_table(path), where=str(path))
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


def _table(path: Path) -> dict[str, Any]:
    """Return the table of a file, over that of its `based_on`.

    Keys that `without` names are removed first.
    """
    table = read_toml(path)
    for image in ("pitch", "colour"):
        own = table.get(image)
        if isinstance(own, dict) and str(own.get("codec", "")).endswith(".py"):
            own["codec"] = str(path.parent / own["codec"])
    if "based_on" not in table:
        return table
    base = read_toml(path.parent / str(table.pop("based_on")))
    for name in table.pop("without", []):
        _remove(base, str(name))
    return _overlaid(base, table)


def _remove(table: dict[str, Any], name: str) -> None:
    """Remove a key, or all that begins with it, like `blocks.status`.

    Raises ValueError when nothing has that name.
    """
    *inner, last = name.split(".")
    for key in inner:
        table = table.get(key, {})
    if last not in table:
        raise ValueError(f"{name} is not in the profile, and cannot be removed from it")
    del table[last]


def _overlaid(base: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    merged = dict(base)
    for key, value in own.items():
        before = merged.get(key)
        merged[key] = _overlaid(before, value) if isinstance(before, dict) and isinstance(value, dict) else value
    return merged

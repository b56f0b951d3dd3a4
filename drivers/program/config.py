"""The `[scanner]` table of a station whose scanner is a program, checked."""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Mapping
from dataclasses import make_dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drivers.scanner import CaptureSettings, SettingsError, setting

PLACEHOLDER = re.compile(r"\{(\w+)\}")
PLACE = ("opening", "attempt")
COMPARE = "compare the table with docs/how-to/connect-any-scanner.md"
Command = Annotated[list[str], Field(min_length=1)]
Value = bool | int | float | str


class SettingConfig(BaseModel):
    """One of `[scanner.settings]`: a setting that the program takes as `{name}`.

    default  its kind is that of the setting; a text is one of the choices.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)
    default: Value
    text: str = ""
    unit: str = ""
    low: float | None = None
    high: float | None = None
    choices: tuple[str, ...] = Field(default=(), strict=False)

    @model_validator(mode="after")
    def _is_of_one_kind(self) -> SettingConfig:
        if isinstance(self.default, str) != bool(self.choices):
            raise ValueError("a default that is a text needs choices, and only such a one has them")
        return self

    def declared(self) -> tuple[type, Any]:
        """The annotation and the field of a class of settings."""
        kind: Any = Literal[self.choices] if self.choices else type(self.default)
        return kind, setting(self.default, self.text, unit=self.unit, low=self.low, high=self.high)


class ProgramConfig(BaseModel):
    """The table `[scanner]`.

    capture    the program and its arguments, run for each shot; {name} in them is replaced.
    output     name of the file that it writes, in a folder made for the shot.
    check      run when the scanner is opened: it must end well, and the first line that it prints names the scanner.
    park       run at the end, and after a shot that failed: leaves the scanner safe.
    timeout_s  after which a program is ended.
    settle_s   in which the size of its file must not change.
    unit, grid, depth  how the file is read, as options of `planish restore`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    driver: Literal["program"] = "program"
    capture: Command
    output: Annotated[str, Field(pattern=r"^[^./\\\x00][^/\\\x00]*\.[^/\\\x00]+$", max_length=100)] = "shot.ply"
    check: Command | None = None
    park: Command | None = None
    timeout_s: Annotated[float, Field(ge=1, le=3600, allow_inf_nan=False)] = 120.0
    settle_s: Annotated[float, Field(ge=0, le=60, allow_inf_nan=False)] = 1.0
    unit: str = "auto"
    grid: str = "auto"
    depth: str = "auto"
    settings: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")], SettingConfig] = {}

    @property
    def reading(self) -> dict[str, str]:
        """How the file is read, as for `load_scan`."""
        return {"unit": self.unit, "grid": self.grid, "depth": self.depth}

    @property
    def named(self) -> set[str]:
        """The placeholders in the command of a capture."""
        return {name for word in self.capture for name in PLACEHOLDER.findall(word)}


def read(config: Mapping[str, Any]) -> ProgramConfig:
    """Check the table. Raises SettingsError that names the setting."""
    try:
        table = ProgramConfig.model_validate(dict(config))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(["scanner", *map(str, first["loc"])])
        raise SettingsError(f"{where}: {first['msg']}", COMPARE) from error
    values = {"python", "output", *PLACE, *(one.name for one in class_of(table).declared())}
    for key, command, known in (
        ("capture", table.capture, values),
        ("check", table.check, {"python"}),
        ("park", table.park, {"python"}),
    ):
        unknown = sorted({name for word in command or () for name in PLACEHOLDER.findall(word)} - known)
        if unknown:
            raise SettingsError(
                f"scanner.{key}: {{{unknown[0]}}} is not known",
                f"use {', '.join(f'{{{name}}}' for name in sorted(known))}, or declare it in [scanner.settings]",
            )
        if command and command[0] != "{python}" and shutil.which(command[0]) is None:
            raise SettingsError(
                f"scanner.{key}: the program {command[0]!r} does not exist", "give its path, or install it"
            )
    return table


def settings_of(config: Mapping[str, Any]) -> type[CaptureSettings]:
    """Return the class of the settings that a table declares. Raises SettingsError."""
    return class_of(read(config))


def class_of(table: ProgramConfig) -> type[CaptureSettings]:
    """Return the class of the settings that a table declares.

    Several shots are averaged only by a program that takes {average}.
    """
    taken = {one.name for one in CaptureSettings.declared()} | {"python", "output", *PLACE}
    for name in table.settings:
        if name in taken:
            raise SettingsError(f"scanner.settings.{name}: the name is taken", "give it another one")
    own = [(name, *one.declared()) for name, one in table.settings.items()]
    if "average" not in table.named:
        own.append(("average", int, setting(1, "the program takes one shot", low=1, high=1)))
    made: type[CaptureSettings] = make_dataclass(
        "ProgramSettings", own, bases=(CaptureSettings,), frozen=True, kw_only=True
    )
    try:
        made()
    except SettingsError as error:
        raise SettingsError(f"scanner.settings.{error}", error.hint) from error
    return made


def replaced(command: list[str], values: Mapping[str, object]) -> list[str]:
    """Return a command with its placeholders replaced.

    >>> replaced(["{python}", "-V", "a{output}b"], {"output": "x"})[1:]
    ['-V', 'axb']
    """
    table = {"python": sys.executable, **values}
    return [PLACEHOLDER.sub(lambda found: str(table[found[1]]), word) for word in command]

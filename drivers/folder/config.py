"""The `[scanner]` table of a station whose scans arrive in a folder, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.scanner import CaptureSettings, SettingsError, setting

Seconds = Annotated[float, Field(ge=0, le=3600, allow_inf_nan=False)]


class FolderConfig(BaseModel):
    """The table `[scanner]`.

    folder     where the scanner's program saves its scans.
    pattern    of their names; other files there are companions, as the pictures of a mesh.
    settle_s   time without a change in the folder after which a scan is complete.
    timeout_s  time that a capture waits for a scan.
    unit, grid, depth  how a scan is read, as options of `planish restore`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    driver: Literal["folder"] = "folder"
    folder: Path
    pattern: Annotated[str, Field(pattern=r"^[^/\\\x00]+$")]
    settle_s: Seconds = 1.0
    timeout_s: Seconds = 60.0
    unit: str = "auto"
    grid: str = "auto"
    depth: str = "auto"


@dataclass(frozen=True, kw_only=True)
class FolderSettings(CaptureSettings):
    """Settings of a shot that was taken by hand: nothing is averaged."""

    average: int = setting(1, "a file is one shot", low=1, high=1)


def read(config: Mapping[str, Any]) -> FolderConfig:
    """Check the table. Raises SettingsError that names the setting."""
    try:
        return FolderConfig.model_validate(dict(config))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(["scanner", *map(str, first["loc"])])
        hint = "compare the table with docs/how-to/connect-any-scanner.md"
        raise SettingsError(f"{where}: {first['msg']}", hint) from error


def settings_of(config: Mapping[str, Any]) -> type[FolderSettings]:
    """The class of the settings of a table. Raises SettingsError."""
    read(config)
    return FolderSettings

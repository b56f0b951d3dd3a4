"""The `[scanner]` table of a station with a real Vivid 900, checked."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.scanner import SettingsError

_Model = ConfigDict(frozen=True, extra="forbid")


class Sg(BaseModel):
    """A SCSI card, or any other device with a node /dev/sg*."""

    model_config = _Model
    kind: Literal["sg"]
    device: Path


class Usb(BaseModel):
    """USB–SCSI bridge by its USB numbers.

    target: the scanner's SCSI ID, 5 as it leaves the factory.
    """

    model_config = _Model
    kind: Literal["usb"]
    vendor: Annotated[int, Field(ge=0, le=0xFFFF)]
    product: Annotated[int, Field(ge=0, le=0xFFFF)]
    target: Annotated[int, Field(ge=0, le=7)] = 5


class Socket(BaseModel):
    """A simulated device in another process: `python -m drivers.simulated`."""

    model_config = _Model
    kind: Literal["socket"]
    port: Annotated[int, Field(ge=1, le=65535)]
    host: str = "127.0.0.1"


class Replay(BaseModel):
    """A recorded conversation in place of a scanner."""

    model_config = _Model
    kind: Literal["replay"]
    file: Path


TransportSettings = Annotated[Sg | Usb | Socket | Replay, Field(discriminator="kind")]


class ScannerConfig(BaseModel):
    """The table `[scanner]`.

    profile: name of a command profile, or the path of its file; a real scanner has no default.
    calibration: file of the body and lens; None for the manual's figures.
    lens: the mounted lens, for scanners that do not report it.
    record: file to write the conversation to.
    """

    model_config = _Model
    driver: Literal["vivid900"] = "vivid900"
    transport: TransportSettings
    profile: str
    calibration: Path | None = None
    lens: Literal["TELE", "MIDDLE", "WIDE"] | None = None
    record: Path | None = None


def read(config: Mapping[str, Any]) -> ScannerConfig:
    """Check the table. Raises SettingsError that names the setting."""
    try:
        return ScannerConfig.model_validate(dict(config))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        setting = ".".join(["scanner", *map(str, first["loc"])])
        raise SettingsError(f"{setting}: {first['msg']}", "compare the table with configs/vivid900.toml") from error

"""The `[scanner]` table of a station configuration, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.scanner import SettingsError
from drivers.simulated.scene.artwork import ARTWORK, Artwork
from drivers.simulated.scene.light import DESK_LIGHT, Light
from drivers.simulated.scene.scene import Axle, Pose, Table
from drivers.simulated.scene.sheets import SHEETS, Sheet
from drivers.vivid900.profile.profile import SIMULATED
from drivers.vivid900.settings import MAX_DISTANCE_MM, MIN_DISTANCE_MM

Side = Annotated[float, Field(ge=20, le=1200)]  # the widest lens sees 1196 mm at its farthest (hardware manual p. 56)
Part = TypeVar("Part")


class SceneConfig(BaseModel):
    """The table `[scanner.scene]`.

    sheet, artwork  a name, or a table of a name and its parameters.
    axle            about which a simulated turntable turns all of it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    sheet: str | dict[str, Any] = "binding"
    artwork: str | dict[str, Any] = "markers"
    page_mm: tuple[Side, Side] = (280.0, 200.0)
    pose: Pose = Pose()
    axle: Axle = Axle()
    table: Table = "dark"
    gap_mm: Annotated[float, Field(ge=0, le=500)] = 3.0
    light: Light = DESK_LIGHT

    def build(self) -> tuple[Sheet, Artwork]:
        """The sheet and the artwork that are named. Raises SettingsError."""
        return _named(SHEETS, self.sheet, "scanner.scene.sheet"), _named(ARTWORK, self.artwork, "scanner.scene.artwork")


Kind = Literal["spread", "blank", "plate", "leaf", "foldout", "cover"]
FirstShot = Literal["good", "not turned", "out of focus"]


class OpeningConfig(SceneConfig):
    """One of `[[scanner.book]]`: an opening to which the leaves can be turned.

    lies        what lies there, in words.
    kind        of it; `blank` for an opening without print.
    labels      of its leaf sides, left to right; those that are not numbered have none.
    first_shot  what happens at the first capture; the later ones are good. `not turned`: it shows the opening before.
    """

    lies: str = ""
    kind: Kind = "spread"
    labels: tuple[str, ...] = ()
    first_shot: FirstShot = "good"


class ScannerConfig(BaseModel):
    """The table `[scanner]`.

    `distance_mm` is the distance of the page, and where the scanner focuses without a setting.
    profile: name or file of the command profile that device and driver speak.
    calibration: calibration file that the driver uses; None for the manual's figures.
    body: calibration file of the simulated body's true geometry, which the driver does not know.
    nudge_px: largest displacement of the page between captures, in pixels of the colour image; none on a turntable.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    driver: Literal["simulated"] = "simulated"
    lens: Literal["TELE", "MIDDLE", "WIDE"] = "MIDDLE"
    distance_mm: Annotated[float, Field(ge=MIN_DISTANCE_MM, le=MAX_DISTANCE_MM)] = 900.0
    seed: Annotated[int, Field(ge=0)] = 0
    profile: str = SIMULATED
    calibration: str | None = None
    body: str | None = None
    nudge_px: Annotated[float, Field(ge=0, le=50)] = 0.0
    scene: SceneConfig = SceneConfig()
    book: tuple[OpeningConfig, ...] = ()


def _parameters(kind: Any) -> list[str]:
    return [field.name for field in fields(kind)]


SETTINGS: dict[tuple[int | str, ...], list[str]] = {
    (): list(ScannerConfig.model_fields),
    ("scene",): list(SceneConfig.model_fields),
    ("scene", "pose"): _parameters(Pose),
    ("scene", "light"): _parameters(Light),
    ("scene", "axle"): _parameters(Axle),
    ("book",): list(OpeningConfig.model_fields),
}
"""Where in the table → the settings that there may be."""


def read(config: Mapping[str, Any]) -> ScannerConfig:
    """Check the table.

    Raises SettingsError that names the setting, and its possible values.
    """
    try:
        return ScannerConfig.model_validate(dict(config))
    except ValidationError as error:
        place = tuple(name for name in error.errors()[0]["loc"] if isinstance(name, str))
        known = next(SETTINGS[place[:i]] for i in range(len(place) - 1, -1, -1) if place[:i] in SETTINGS)
        raise _refusal(error, "scanner", known) from error


def _named(table: Mapping[str, type[Part]], spec: str | dict[str, Any], where: str) -> Part:
    parameters = {"name": spec} if isinstance(spec, str) else dict(spec)
    name = str(parameters.pop("name", ""))
    if name not in table:
        raise SettingsError(f"{where}: {name!r} is not known", f"use one of: {', '.join(sorted(table))}")
    kind: Any = table[name]
    try:
        part: Part = kind(**parameters)
    except ValidationError as error:
        raise _refusal(error, where, _parameters(kind)) from error
    return part


def _refusal(error: ValidationError, where: str, known: list[str]) -> SettingsError:
    first = error.errors()[0]
    setting = ".".join([where, *map(str, first["loc"])])
    return SettingsError(f"{setting}: {first['msg']}, not {first['input']!r}", f"settings here: {', '.join(known)}")

"""The configuration of a station, and validation of settings.

Under the names that the operator uses.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, InstanceOf, ValidationError, ValidationInfo, field_validator

from drivers import DRIVERS, CaptureSettings, SettingsError, settings_of
from drivers.shipped import CONFIGS
from restore import Settings
from restore.files import read_toml
from station.errors import UsageError

Model = TypeVar("Model", bound=BaseModel)

DEMONSTRATION = Path("simulated")
BOOK = Path("simulated-book")
COMPARE = f"compare it with {CONFIGS / 'simulated.toml'}"


class OutputSettings(BaseModel):
    """stem: first part of the name of every file that a scan leaves."""

    model_config = ConfigDict(frozen=True, extra="forbid")
    stem: str = Field(default="page", pattern=r"^[^./\\\x00][^/\\\x00]*$", max_length=200)


Millimetres = tuple[float, float, float]


class AxisSettings(BaseModel):
    """The axis of the turntable in the scanner's frame, as `planish axis` finds it.

    point_mm   any point on it.
    direction  of any length; the stage turns counter-clockwise seen against it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    point_mm: Millimetres
    direction: Millimetres

    @field_validator("direction")
    @classmethod
    def _points_somewhere(cls, direction: Millimetres) -> Millimetres:
        if not any(direction):
            raise ValueError("direction has no length")
        return direction


class TurntableSettings(BaseModel):
    """The turntable.

    model     of its controller, from the table in docs/reference/turntable-controllers.md.
    port      its serial port.
    relative  True when the controller takes rotations relative to its position.
    arc_deg   angle that the views cover: a full turn, or less for a page that stands upright.
    axis      axis of rotation; not needed to calibrate it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    model: str
    port: str
    relative: bool = False
    arc_deg: float = Field(default=360.0, gt=0, le=360)
    axis: AxisSettings | None = None


class StationConfig(BaseModel):
    """Configuration of a station.

    scanner: for the driver that it names; capture: its settings of a capture.
    stage: None without a turntable.
    The rest as the models of the same names.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    scanner: dict[str, Any]
    turntable: TurntableSettings | None = None
    capture: Annotated[InstanceOf[CaptureSettings], Field(validate_default=True)] = CaptureSettings()
    restore: Settings = Settings()
    output: OutputSettings = OutputSettings()

    @field_validator("scanner")
    @classmethod
    def _names_a_driver(cls, scanner: dict[str, Any]) -> dict[str, Any]:
        if not isinstance(scanner.get("driver"), str) or scanner["driver"] not in DRIVERS:
            raise ValueError(f"driver = {scanner.get('driver')!r} is not known, use one of: {', '.join(DRIVERS)}")
        return scanner

    @field_validator("capture", mode="before")
    @classmethod
    def _of_the_driver(cls, capture: Any, info: ValidationInfo) -> Any:
        if "scanner" not in info.data or not isinstance(capture, Mapping | CaptureSettings):
            return CaptureSettings() if "scanner" not in info.data else capture  # its own mistake is reported
        settings = settings_of(info.data["scanner"])
        try:
            return settings.of(capture if isinstance(capture, Mapping) else vars(capture))
        except SettingsError as error:
            raise SettingsError(f"capture.{error}", error.hint) from error


def load_config(path: Path) -> StationConfig:
    """Read a station's TOML file, or a shipped one by its name.

    Raises UsageError that names file and key.
    """
    name = path
    if path.suffix != ".toml" and (path.is_dir() or not path.exists()):
        path = CONFIGS / f"{path}.toml"
    try:
        table = read_toml(path)
    except FileNotFoundError as error:
        raise not_there("configuration", str(name), CONFIGS) from error
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}", "check the path after --config") from error
    except ValueError as error:  # TOMLDecodeError and UnicodeDecodeError
        raise UsageError(f"{path} is not a TOML file: {error}", COMPARE) from error
    _resolve_file_names(path, table.get("scanner"))
    try:
        return build_model(StationConfig, table, name=lambda key: f"{path}: {key}", hint=COMPARE)
    except SettingsError as error:
        raise UsageError(f"{path}: {error}", error.hint) from error


def not_there(what: str, name: str, shipped: Path) -> UsageError:
    """Return the error for a TOML file that does not exist.

    It names one that was meant, and the bundled ones.
    """
    meant = Path(f"{name}.toml")
    own = f"give the whole name, {meant}" if meant.is_file() else "give the path of a TOML file"
    named = ", ".join(sorted(path.stem for path in shipped.glob("*.toml")))
    return UsageError(f"the {what} {name!r} does not exist", f"{own}, or a bundled one: {named}")


def _resolve_file_names(path: Path, scanner: Any) -> None:
    """Resolve a scanner table's file names, in place, against the configuration's folder."""
    if isinstance(scanner, dict):
        for key in ("profile", "calibration", "body"):
            if str(scanner.get(key, "")).endswith(".toml"):
                scanner[key] = str(path.parent / scanner[key])
        if isinstance(scanner.get("folder"), str):
            scanner["folder"] = str(path.parent / scanner["folder"])
        for key, words in scanner.items():
            if isinstance(words, list):  # a command, which is run in another folder
                scanner[key] = [_resolved(word, path.parent) if isinstance(word, str) else word for word in words]


def _resolved(word: str, folder: Path) -> str:
    return str((folder / word).resolve()) if (folder / word).is_file() else word


def build_model(model: type[Model], values: Mapping[str, Any], *, name: Callable[[str], str], hint: str) -> Model:
    """Build the model.

    Raises UsageError for the values that do not fit, under the names the caller knows.
    """
    try:
        return model.model_validate(values)
    except ValidationError as error:
        mistakes = [(_key_of(one), _validation_message(one)) for one in error.errors(include_url=False)]
        lines = [f"{name(key)}: {message}" for key, message in mistakes]
        file = name("").rstrip()  # which is named once
        texts = [lines[0], *(line.removeprefix(file).lstrip() if file.endswith(":") else line for line in lines[1:])]
        raise UsageError("; ".join(texts), hint) from error


def _key_of(error: Mapping[str, Any]) -> str:
    return ".".join(str(part) for part in error["loc"])


def _validation_message(error: Mapping[str, Any]) -> str:
    match error["type"]:
        case "missing":
            return "is missing"
        case "extra_forbidden" | "unexpected_keyword_argument":
            return "is not a known setting"
        case "string_too_long":
            return f"has {len(error['input'])} characters, {error['ctx']['max_length']} are the most"
        case "value_error":
            return str(error["ctx"]["error"])
    return f"{error['input']!r} is not usable: {error['msg'][0].lower()}{error['msg'][1:]}"

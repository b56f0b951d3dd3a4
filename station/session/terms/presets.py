"""Presets: how the pages of a kind of volume are processed.

They are restored, checked and numbered by it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from drivers.shipped import CONFIGS
from restore import Settings
from restore.files import read_toml
from station.choices import FLAGS, Layout
from station.config import build_model, not_there
from station.errors import UsageError
from station.verdict.thresholds import Thresholds, check_limits

PRESETS = CONFIGS / "presets"
COMPARE = f"compare it with {PRESETS / 'book.toml'}"
Length = Annotated[float, Field(gt=0, le=3000)]


class Preset(BaseModel):
    """Preset.

    settings    of the restoration; those that are not named are by default.
    outputs     files in addition to the page, as the options of `planish restore` are called.
    foliation   how pages are numbered: `pages` (1, 2, 3), `folios` (1r, 1v, 2r) or `none`.
    first       the number of the first page or leaf.
    sides       whether pages lie left and right in turn, the first one `left` or `right`; None for single sheets.
    layout      what becomes of an opened book, as the option of `planish restore` is called.
    size_mm     width and height of a leaf, which is compared with each. overlap_mm: of the facing page that it keeps.
    direction   in which the leaves are read, where the description of the volume does not say.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    settings: dict[str, Any] = {}
    outputs: tuple[str, ...] = ("coverage",)
    language: str = "eng"
    foliation: Literal["pages", "folios", "none"] = "pages"
    first: int = Field(default=1, ge=0, le=100_000)
    sides: Literal["left", "right"] | None = None
    layout: Layout = Layout.SINGLE
    size_mm: tuple[Length, Length] | None = None
    overlap_mm: float | None = Field(default=None, ge=0, le=10)
    direction: Literal["ltr", "rtl"] | None = None
    thresholds: Thresholds = Thresholds()

    @field_validator("settings")
    @classmethod
    def _are_settings(cls, settings: dict[str, Any]) -> dict[str, Any]:
        Settings.model_validate(settings)
        return settings

    @field_validator("outputs")
    @classmethod
    def _are_known(cls, outputs: tuple[str, ...]) -> tuple[str, ...]:
        unknown = sorted(set(outputs) - set(FLAGS))
        if unknown:
            raise ValueError(f"{unknown[0]!r} is not an output; there are {', '.join(FLAGS)}")
        return outputs

    def parameters(self, scale: str | None = None, **reading: str) -> dict[str, Any]:
        """Return the parameters of a restoration, every setting by name.

        A later default changes none of them.
        scale: of photographs. reading: how a scan is read, as for `load_scan`.
        """
        settings = Settings.model_validate(self.settings).model_dump(mode="json")
        outputs = sorted({*self.outputs, "coverage"})
        how = {"unit": "auto", **reading} | ({} if scale is None else {"scale": scale})
        how |= {} if self.layout == Layout.SINGLE else {"layout": str(self.layout)}
        return {"settings": settings, "outputs": outputs, "language": self.language, **how}

    def side(self, position: int) -> str:
        """`left` or `right` of the opening, empty for single sheets."""
        if self.sides is None:
            return ""
        return ("left", "right")[(position - 1 + (self.sides == "right")) % 2]


def changed_preset(preset: Preset, changed: Mapping[str, Any]) -> Preset:
    """Return a preset with other `settings` and `thresholds`.

    Where they are named. Raises ValidationError.
    """
    values = preset.model_dump(mode="json", exclude_none=True)
    for name in ("settings", "thresholds"):
        values[name] = {**values[name], **changed.get(name, {})}
    return Preset.model_validate(values)


def load_preset(name: str) -> Preset:
    """Return a bundled preset by its name, or one from a TOML file.

    Raises UsageError that names file and key.
    """
    path = Path(name) if name.endswith(".toml") else PRESETS / f"{name}.toml"
    try:
        table = read_toml(path)
    except FileNotFoundError as error:
        raise not_there("preset", name, PRESETS) from error
    except OSError as error:
        raise UsageError(f"cannot read the preset {name}: {error.strerror}", "check the path") from error
    except ValueError as error:  # TOMLDecodeError and UnicodeDecodeError
        raise UsageError(f"the preset {name} is not a TOML file: {error}", COMPARE) from error
    return build_preset(table, str(path))


def build_preset(table: dict[str, Any], where: str) -> Preset:
    """Return the preset of a table.

    where: what the table stands in.
    Raises UsageError that names the key.
    """
    preset = build_model(Preset, table, name=lambda key: f"{where}: {key}", hint=COMPARE)
    for name, limits in preset.thresholds:
        try:
            check_limits(name, limits)
        except ValueError as error:
            raise UsageError(f"{where}: thresholds.{name}: {error}", COMPARE) from error
    return preset

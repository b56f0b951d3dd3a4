"""Presets: `planish.toml` in the watched folder or a sub-folder.

They set the options of the scans there and below.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationInfo, field_validator

from restore import BadInput, Settings
from restore.files import read_toml
from restore.formats import check_depth, check_unit, parse_grid
from station.choices import FLAGS
from station.config import build_model
from station.errors import UsageError
from station.intake.listing import Listing, Stamp
from station.run.options import AUTO, READING, RunOptions

PRESET = "planish.toml"
OUTPUTS = ", ".join(map(repr, FLAGS))
HINT = f"settings are those of `planish restore`, and outputs = [{OUTPUTS}], language, unit, grid, depth"


class _Preset(Settings):
    """Keys of a preset: settings, and some others."""

    outputs: list[str] | None = None
    language: str | None = None
    unit: str | None = None
    grid: str | None = None
    depth: str | None = None

    @field_validator("outputs")
    @classmethod
    def _are_known(cls, outputs: list[str] | None) -> list[str] | None:
        if unknown := sorted(set(outputs or ()) - set(FLAGS)):
            raise ValueError(f"{unknown[0]!r} is not known")
        return outputs

    @field_validator(*READING)
    @classmethod
    def _can_be_read(cls, value: str | None, info: ValidationInfo) -> str | None:
        check = {"unit": check_unit, "grid": parse_grid, "depth": check_depth}[str(info.field_name)]
        try:
            check(value or AUTO)
        except BadInput as error:
            raise ValueError(str(error)) from error
        return value


class Presets:
    """The options for each sub-folder; files are read again when they change."""

    def __init__(self, folder: Path, base: RunOptions) -> None:
        self._folder, self._base = folder, base
        self._read: dict[Path, tuple[Stamp, Mapping[str, Any]]] = {}
        self._listing: Listing = {}

    def update(self, listing: Listing) -> None:
        """Take a new listing."""
        self._listing = listing

    def options(self, sub: Path) -> RunOptions:
        """Return a sub-folder's options: presets from the watched folder down, over the base.

        Raises UsageError that names the file and the key.
        """
        options = self._base
        for place in reversed([sub, *sub.parents]):
            if place / PRESET in self._listing:
                options = self._with_preset(options, place / PRESET, self._listing[place / PRESET])
        return options

    def _with_preset(self, options: RunOptions, preset: Path, stamp: Stamp) -> RunOptions:
        path = self._folder / preset
        table = self._table(preset, stamp)
        checked = build_model(_Preset, table, name=lambda key: f"{path}: {key}", hint=HINT)
        given = checked.model_dump(exclude_unset=True)
        settings = {key: given.pop(key) for key in Settings.model_fields if key in given}
        if "outputs" in given:
            given["outputs"] = frozenset(given["outputs"])
        return replace(options, settings=options.settings.model_copy(update=settings), **given)

    def _table(self, preset: Path, stamp: Stamp) -> Mapping[str, Any]:
        known = self._read.get(preset)
        if known is None or known[0] != stamp:
            path = self._folder / preset
            try:
                known = self._read[preset] = stamp, read_toml(path)
            except (OSError, ValueError) as error:
                raise UsageError(f"cannot read the preset {path}: {error}", HINT) from error
        return known[1]

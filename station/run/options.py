"""How a scan is restored and what is written of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from restore import Settings
from station.choices import FLAGS
from station.config import build_model

HINT = f"settings are those of `planish restore`, and outputs = [{', '.join(map(repr, FLAGS))}], language, unit"
AUTO = "auto"


@dataclass(frozen=True)
class Options:
    """How scans are restored.

    settings  those that are given; the rest is by default.
    outputs, language, colours, to_srgb  as the kinds, language, colours and to_srgb of a `Destination`.
    unit  of the meshes' coordinates, as for `restore_file`; range images have their own.
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    outputs: frozenset[str] = frozenset()
    language: str = "eng"
    colours: bytes | None = None
    to_srgb: bool = False
    unit: str = AUTO

    def build(self, where: str) -> Settings:
        """The settings, checked. where: the file or option that they come from. Raises UsageError."""
        return build_model(Settings, self.settings, name=lambda key: f"{where}: {key}", hint=HINT)

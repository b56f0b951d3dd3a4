"""Warped sheets of paper. SHEETS maps the name in a configuration to the sheet."""

from __future__ import annotations

from drivers.simulated.scene.sheets.bent import Binding, Curl, Flat, Spread, Wave
from drivers.simulated.scene.sheets.cone import Cone
from drivers.simulated.scene.sheets.crumpled import Crumpled
from drivers.simulated.scene.sheets.folded import Miura, MultiFold
from drivers.simulated.scene.sheets.opening import Opening
from drivers.simulated.scene.sheets.sheet import PageSize, Sheet

__all__ = [
    "SHEETS",
    "Binding",
    "Cone",
    "Crumpled",
    "Curl",
    "Flat",
    "Miura",
    "MultiFold",
    "Opening",
    "PageSize",
    "Sheet",
    "Spread",
    "Wave",
]

SHEETS: dict[str, type[Sheet]] = {
    kind.name: kind for kind in (Flat, Curl, Binding, Spread, Opening, Wave, Cone, MultiFold, Miura, Crumpled)
}

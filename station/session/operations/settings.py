"""Change settings of the preset of a session, for scans and restorations from now on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from station.session.log.events import Event
from station.session.log.facts import SETTINGS
from station.session.log.steps import decide
from station.session.log.store import Writer


def change_settings(writer: Writer, changed: Mapping[str, Mapping[str, Any]]) -> Event:
    """Record all settings that differ from those of the preset, by group. Raises OSError."""
    return decide(writer, SETTINGS, changed)

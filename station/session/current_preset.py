"""The preset of a session as it is now."""

from __future__ import annotations

from station.session.events import VOLUME
from station.session.facts import SETTINGS
from station.session.presets import Preset, changed_preset
from station.session.store import Session


def preset_of(session: Session) -> Preset:
    """The preset that the session began with, with the settings that were changed since."""
    changed = session.history.page(VOLUME).decided(SETTINGS, {})
    return changed_preset(
        Preset.model_validate(session.volume.preset_values), changed if isinstance(changed, dict) else {}
    )

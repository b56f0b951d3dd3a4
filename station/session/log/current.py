"""The preset of a session as it is now."""

from __future__ import annotations

from station.session.log.history import History
from station.session.log.store import Session
from station.session.terms.about import About
from station.session.terms.presets import Preset, changed_preset


def preset_of(session: Session) -> Preset:
    """The preset that the session began with, with the settings that were changed since."""
    return changed_preset(Preset.model_validate(session.volume.preset_values), session.history.volume.decided.settings)


def about_of(history: History) -> About:
    """Return the description of a session's volume, empty but for what the preset says."""
    about = history.volume.decided.about
    of_preset = history.event(1).facts.get("direction")
    return about.model_copy(update={"direction": of_preset}) if of_preset and not about.direction else about

"""Settings of a capture: what a class declares is what is checked and what a form shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import pytest

from drivers import settings_of
from drivers.scanner import CaptureSettings, SettingsError, setting
from drivers.vivid900.settings import VividSettings


@dataclass(frozen=True, kw_only=True)
class OwnSettings(CaptureSettings):
    pattern: Literal["phase", "stripe"] = setting("phase", "which light")
    exposure_ms: float = setting(8.0, "time of a picture", unit="ms", low=0.1, high=100)
    tries: int | None = setting(None, "how often", low=1)
    flash: bool = setting(False, "with a flash")


def test_a_class_declares_the_fields_of_its_form_its_own_first():
    pattern, exposure, tries, flash, *common = OwnSettings.declared()
    assert [one.kind for one in (pattern, exposure, tries, flash)] == ["choice", "number", "integer", "flag"]
    assert pattern.choices == ("phase", "stripe")
    assert (exposure.unit, exposure.low, exposure.high, exposure.optional) == ("ms", 0.1, 100, False)
    assert (tries.optional, tries.high) == (True, None)
    assert [one.name for one in common] == ["average", "deadline_s"]


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"pattern": "speckle"}, "pattern: 'speckle' is not usable"),
        ({"exposure_ms": "8"}, "exposure_ms: '8' is not usable"),
        ({"exposure_ms": float("nan")}, "exposure_ms = nan is out of range"),
        ({"exposure_ms": None}, "exposure_ms: None is not usable"),
        ({"tries": 0}, "tries = 0 is out of range"),
        ({"tries": 1.5}, "tries: 1.5 is not usable"),
        ({"flash": 1}, "flash: 1 is not usable"),
        ({"average": True}, "average: True is not usable"),
        ({"deadline_s": 0.5}, "deadline_s = 0.5 is out of range"),
        ({"speed": 3}, "speed: is not a known setting"),
    ],
)
def test_what_is_not_possible_is_named_with_what_is(values, said):
    with pytest.raises(SettingsError) as caught:
        OwnSettings.of(values)
    assert (str(caught.value), bool(caught.value.hint)) == (said, True)


def test_a_preview_is_one_quick_shot():
    assert OwnSettings(average=4, tries=2).preview() == OwnSettings(tries=2)
    fine = VividSettings(average=4, multi_depth=True, gain=2)
    assert fine.preview() == VividSettings(mode="fast", gain=2)


def test_the_vivid_drivers_have_its_settings():
    assert settings_of({"driver": "simulated"}) is settings_of({"driver": "vivid900"}) is VividSettings
    with pytest.raises(SettingsError, match="'kinect' does not exist"):
        settings_of({"driver": "kinect"})

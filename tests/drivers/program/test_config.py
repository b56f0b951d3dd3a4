"""The table of a scanner that is a program: what it declares, and what it gets wrong."""

from __future__ import annotations

import pytest

from drivers import SettingsError, settings_of
from drivers.program.config import replaced
from tests.drivers.program.conftest import WRITES

EXPOSURE = {"default": 8.0, "low": 0.1, "high": 100, "unit": "ms", "text": "time of a picture"}
ENGINE = {"default": "phase", "choices": ["phase", "stripe"]}


def test_settings_that_a_table_declares_are_those_of_a_capture(table):
    settings = settings_of(table(settings={"exposure_ms": EXPOSURE, "engine": ENGINE, "hdr": {"default": False}}))
    declared = {one.name: one for one in settings.declared()}
    assert list(declared) == ["exposure_ms", "engine", "hdr", "average", "deadline_s"]
    assert (declared["exposure_ms"].unit, declared["exposure_ms"].high) == ("ms", 100)
    assert [declared[name].kind for name in ("exposure_ms", "engine", "hdr")] == ["number", "choice", "flag"]
    assert settings.of({"engine": "stripe"}).engine == "stripe"
    with pytest.raises(SettingsError, match="exposure_ms = 101 is out of range"):
        settings.of({"exposure_ms": 101})


def test_a_program_averages_only_if_it_takes_the_number(table):
    with pytest.raises(SettingsError, match="average = 2 is out of range"):
        settings_of(table()).of({"average": 2})
    assert settings_of(table(WRITES, "{average}")).of({"average": 2}).average == 2


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"capture": []}, "scanner.capture"),
        ({"capture": ["no-such-program-here"]}, "'no-such-program-here' does not exist"),
        ({"capture": ["{python}", "{exposure}"]}, r"scanner.capture: \{exposure\} is not known"),
        ({"check": ["{python}", "{output}"]}, r"scanner.check: \{output\} is not known"),
        ({"output": "../shot.ply"}, "scanner.output"),
        ({"timeout_s": 0}, "scanner.timeout_s"),
        ({"speed": 1}, "scanner.speed"),
        ({"settings": {"output": {"default": 1}}}, "scanner.settings.output: the name is taken"),
        ({"settings": {"engine": {"default": "phase"}}}, "scanner.settings.engine"),
        ({"settings": {"engine": {**ENGINE, "default": "speckle"}}}, "scanner.settings.engine: 'speckle'"),
        ({"settings": {"gain": {"default": 9, "high": 7}}}, "scanner.settings.gain = 9 is out of range"),
    ],
)
def test_a_mistake_is_named_before_anything_runs(table, keys, said):
    with pytest.raises(SettingsError, match=said) as caught:
        settings_of({**table(), **keys})
    assert caught.value.hint


def test_a_word_without_a_placeholder_stays():
    assert replaced(["a", "{}", "{output}"], {"output": "x"}) == ["a", "{}", "x"]

"""Levels of measures beside their limits."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from restore import Finding
from station.verdict.checks import LEVELS, as_result, check_measures, level_of, questions, worst
from station.verdict.same_page import fingerprint
from station.verdict.table import MEASURES
from station.verdict.thresholds import Thresholds

NUMBERS = st.floats(-1e6, 1e6)


def picture(seed: int) -> str:
    return fingerprint(np.random.default_rng(seed).integers(0, 256, (200, 200, 3), np.uint8))


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS)
def test_more_in_the_worse_direction_is_never_better(one, other, amber, red):
    low, high = sorted([one, other])
    levels = [LEVELS.index(level_of(value, (amber, red))) for value in (low, high)]
    assert levels == sorted(levels, reverse=amber > red)


def test_the_limits_themselves_belong_to_the_better_level():
    assert [level_of(value, (1.0, 2.0)) for value in (1.0, 1.1, 2.0, 2.1)] == ["green", "amber", "amber", "red"]
    assert [level_of(value, (2.0, 1.0)) for value in (2.0, 1.9, 1.0, 0.9)] == ["green", "amber", "amber", "red"]


def test_every_check_of_a_preset_has_words():
    assert set(MEASURES) == set(Thresholds.model_fields)


def test_the_worst_finding_decides_and_comes_first():
    limits = Thresholds(smooth_strain_rms=(0.1, 0.2), blur_px=(1.0, 2.0), hole_mm=(1.0, 2.0), similarity=(0.6, 0.8))
    measures = {
        "smooth_strain_rms": 0.3,
        "blur_px": 1.5,
        "hole_mm": None,
        "measured_fraction": 0.0,
        "fingerprint": picture(1),
    }
    level, findings = check_measures(measures, limits, {4: picture(2), 7: picture(1)})
    assert (level, [(one.name, one.level) for one in findings]) == (
        "red",
        [("smooth_strain_rms", "red"), ("similarity", "red"), ("blur_px", "amber")],
    )
    assert findings[1].text.startswith("same page as page 7 1.00 (amber > 0.60, red > 0.80)")
    assert as_result(findings)["checks"][0]["limits"] == [0.1, 0.2]


def test_a_question_is_amber_and_a_doubt_red():
    sizes = dict.fromkeys(("width_mm", "height_mm", "given_width_mm", "given_height_mm"), 1.0)
    asked = [Finding.of(code, **sizes) for code in ("size_differs", "size_wrong")] + [Finding.of("no_picture")]
    found = questions({"findings": [one.as_json() for one in asked]})
    assert [(one.name, one.level) for one in found] == [("size", "amber"), ("size", "red")]
    assert all(one.level == level_of(one.value, one.limits) for one in found)


def test_nothing_to_check_is_green():
    assert worst([]) == "green"
    assert check_measures({"fingerprint": picture(1)}, Thresholds(), {})[0] == "green"

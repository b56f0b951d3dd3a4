"""The options have limits, and unknown ones are rejected."""

import pytest
from pydantic import ValidationError

from restore.flattening.methods import METHODS
from restore.settings import Settings


def test_defaults_are_a_thousand_points_at_150_dpi_with_shading_kept():
    expected = {"points": 1000, "dpi": 150.0, "method": "isometric", "shading": "keep"}
    assert Settings().model_dump(include=set(expected)) == expected


@pytest.mark.parametrize(
    "options",
    [{"points": 0}, {"points": 50}, {"points": 400_000}, {"dpi": 30}, {"dpi": 1200}, {"shading": "remove"}]
    + [{"method": method} for method in METHODS],
)
def test_values_within_the_limits_are_accepted(options):
    assert Settings(**options).model_dump(include=set(options)) == options


@pytest.mark.parametrize(
    "options",
    [
        {"points": -1},
        {"points": 1},
        {"points": 49},
        {"points": 400_001},
        {"points": 99.5},
        {"dpi": 29.9},
        {"dpi": 1201},
        {"dpi": float("nan")},
        {"dpi": float("inf")},
        {"method": "ironing"},
        {"shading": "half"},
        {"colour": "grey"},
    ],
)
def test_values_beyond_the_limits_are_rejected_by_name(options):
    with pytest.raises(ValidationError) as caught:
        Settings(**options)
    (error,) = caught.value.errors()
    assert error["loc"] == tuple(options)


def test_settings_are_immutable():
    with pytest.raises(ValidationError, match="frozen"):
        Settings().points = 500

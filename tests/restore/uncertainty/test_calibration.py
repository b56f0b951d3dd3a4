"""What a report says of the calibration, and the interval of the size that follows."""

import pytest

from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES
from oracles.hidden_body import HIDDEN_BODY
from restore.uncertainty.calibration import NORMAL_95, describe_calibration, edge_error, size_interval

MEASURED = {"date": "2026-01-31", "captures": 12, "lines_rms": 0.04, "expected_mm": 0.1, "markers_px": None}


def described(calibration, **measured):
    table = calibration.as_json() | ({"measured": measured} if measured else {})
    return describe_calibration({"calibration": table})


def test_the_manuals_figures_are_nominal_and_a_deviating_body_is_measured():
    assert described(nominal(LENSES["WIDE"])) == {"kind": "nominal"}
    assert described(HIDDEN_BODY)["kind"] == "measured"
    assert described(HIDDEN_BODY)["expected_mm"] is None
    assert described(HIDDEN_BODY, **MEASURED) == {"kind": "measured", **MEASURED, "expected_length": None}


def test_a_scan_of_another_program_says_nothing():
    assert describe_calibration({"device": "another"}) == {"kind": "unknown"}
    assert describe_calibration({"calibration": "none"}) == {"kind": "unknown"}
    assert size_interval({"kind": "unknown"}, [280.0, 200.0]) is None
    assert size_interval(described(HIDDEN_BODY), [280.0, 200.0]) is None


def test_the_interval_of_a_nominal_size_holds_a_body_that_deviates_by_half_a_per_cent():
    width, height = size_interval({"kind": "nominal"}, [280.0, 200.0])
    assert width == pytest.approx(1.96 * 1.4)
    assert height == pytest.approx(1.96 * 1.0)


def test_the_page_and_the_calibration_add_as_independent_errors():
    alone = size_interval({"kind": "measured", **MEASURED}, [280.0, 200.0])
    assert alone == pytest.approx([NORMAL_95 * 2**0.5 * 0.1] * 2)
    assert edge_error(0.0) == 0.0
    assert edge_error(50.8) == pytest.approx(0.1 * 0.5 * (2 / 3) ** 0.5)  # half a millimetre to a pixel
    by_length = {"kind": "measured", **MEASURED, "expected_length": 1e-4}
    assert size_interval(by_length, [280.0, 200.0]) == pytest.approx([NORMAL_95 * 0.028, NORMAL_95 * 0.02])
    both = size_interval({"kind": "measured", **MEASURED}, [280.0, 200.0], [0.0, 0.1 * 14**0.5])
    assert both == pytest.approx([alone[0], NORMAL_95 * 0.4])

"""What a verdict says about the calibration of a scan."""

from __future__ import annotations

import pytest

from station.verdict.calibration_notes import OLD_DAYS, calibration_notes

MEASURED = {"kind": "measured", "date": "2026-01-31"}


@pytest.mark.parametrize(
    ("calibration", "source", "names"),
    [
        ({"kind": "nominal"}, {}, ["calibration_nominal"]),
        ({"kind": "unknown"}, {"time": "2026-02-01T10:00:00+00:00"}, []),
        (MEASURED, {"time": "2027-01-31T23:59:00+00:00"}, []),
        (MEASURED, {"time": "2027-02-01T00:00:00+00:00"}, ["calibration_old"]),
        (MEASURED, {"time": "2020-02-01T00:00:00+00:00"}, []),  # a clock that was wrong
        (MEASURED, {}, []),
        (MEASURED, {"time": 7}, []),
        ({"kind": "measured", "date": None}, {"time": "2026-02-01T10:00:00+00:00"}, []),
        ({"kind": "measured", "date": "in May"}, {"time": "2026-02-01T10:00:00+00:00"}, []),
    ],
)
def test_a_calibration_is_noted_where_it_is_nominal_or_old(calibration, source, names):
    notes = calibration_notes({"calibration": calibration, "source": source})
    assert [note["name"] for note in notes] == names
    assert all("planish calibrate" in note["hint"] for note in notes)


def test_the_age_is_that_on_the_day_of_the_scan():
    (note,) = calibration_notes({"calibration": MEASURED, "source": {"time": "2027-06-15T08:00:00"}})
    assert f"{OLD_DAYS + 135} days" in note["text"]


def test_a_report_of_another_kind_has_no_notes():
    assert calibration_notes({}) == []

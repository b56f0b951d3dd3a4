"""Stored scans give back what the calibration needs: the pitch as it was measured, and the markers."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.scanner import SettingsError
from drivers.simulated import Flat, Markers, Pose, White, shoot
from drivers.vivid900.calibrating.board import Board
from drivers.vivid900.calibrating.bundle_adjustment import MARKER_PX
from drivers.vivid900.calibrating.plates import MAX_SAMPLES, nominal_of_scans, plate_shot
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FAST, LENSES
from drivers.vivid900.geometry.triangulation import pitch_of, project
from restore.scan import RangeScan

MIDDLE = nominal(LENSES["MIDDLE"], body="77", lens_serial="114")
HIDDEN = replace(MIDDLE, focal_px=1930.0, centre_px=(323.0, 236.0), distortion=(-0.07, 0.08), tilt=1e-3)
ROUND_TRIP = 1e-9  # frames
BOARD = Board()


@pytest.fixture(scope="module")
def shot():
    return shoot(Flat(), Markers(), mode="fast", pose=Pose(tilt_deg=10), body=HIDDEN, calibration=MIDDLE, noise=False)


@pytest.fixture
def scan(shot) -> RangeScan:
    return shot[0]


def test_the_pitch_comes_back_from_points_of_another_calibration(shot) -> None:
    scan, truth = shot
    plate = plate_shot(scan, BOARD, front_mm=899.0)
    cols, rows = ((plate.texture_xy - 0.5) / 2).astype(int).T
    measured = pitch_of(truth.points, HIDDEN, FAST, 900.0)[rows, cols]
    np.testing.assert_allclose(plate.pitch, measured, atol=ROUND_TRIP)
    assert 0.9 * MAX_SAMPLES < len(plate.pitch) < 2 * MAX_SAMPLES
    assert (plate.mode, plate.distance_mm, plate.front_mm) == (FAST, 900.0, 899.0)


def test_only_samples_on_the_board_count(shot) -> None:
    scan, truth = shot
    cols, rows = ((plate_shot(scan, BOARD).texture_xy - 0.5) / 2).astype(int).T
    assert np.isfinite(truth.flat[rows, cols]).all()
    assert np.isnan(truth.flat[scan.measured]).any()  # the table, too, was measured


def test_markers_are_found_where_the_body_shows_them(shot) -> None:
    scan, truth = shot
    plate = plate_shot(scan, BOARD)
    first = truth.markers[0].mean(axis=0)
    seen = project(HIDDEN, truth.surface(plate.on_board + first))
    assert len(seen) == len(truth.markers)
    assert np.sqrt(((plate.pixels - seen) ** 2).mean()) < MARKER_PX


def test_a_plate_without_markers_is_taken_whole() -> None:
    bare, _ = shoot(Flat(), White(), mode="fast", page_mm=(400.0, 300.0), body=HIDDEN)
    plate = plate_shot(bare, BOARD)
    assert plate.pixels.size == 0
    assert np.ptp(plate.texture_xy, axis=0).min() > 450


@pytest.mark.parametrize(
    ("noted", "message"),
    [
        ({"calibration": None}, "calibration"),
        ({"calibration": {"lens": "MIDDLE"}}, "calibration"),
        ({"mode": "slow"}, "slow"),
        ({"mode": "fine"}, "480×640"),
        ({"distance_mm": "near"}, "near"),
        ({"distances_mm": [850, 900]}, "several distances"),
    ],
)
def test_scans_that_do_not_show_how_they_were_taken_are_refused(scan: RangeScan, noted: dict, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        plate_shot(replace(scan, provenance={**scan.provenance, **noted}), BOARD)


def test_scans_of_other_drivers_are_refused(scan: RangeScan) -> None:
    with pytest.raises(SettingsError, match="does not say"):
        plate_shot(replace(scan, provenance={}), BOARD)
    with pytest.raises(SettingsError, match="does not say"):
        nominal_of_scans([replace(scan, provenance={})])


def test_all_scans_have_to_be_of_one_body(scan: RangeScan) -> None:
    assert nominal_of_scans([scan, scan]) == MIDDLE
    other = {**scan.provenance, "calibration": replace(MIDDLE, body="78").as_json()}
    with pytest.raises(SettingsError, match="one body"):
        nominal_of_scans([scan, replace(scan, provenance=other)])
    with pytest.raises(SettingsError, match="one body"):
        nominal_of_scans([])

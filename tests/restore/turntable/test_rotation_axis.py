"""The axis of a turntable from the corners of markers at several angles."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from restore.errors import BadInput
from restore.turntable import RotationAxis, fit_axis
from restore.turntable.axis import axis_of_corners
from restore.turntable.board import board_corners

EXACT = 1e-6  # mm and degrees: the solver stops there
NOISE_MM = 0.1  # a fifth of a sample, as the corners of a simulated board scatter
AXIS_MM, AXIS_DEG = 0.05, 0.02  # a tenth of a sample at the axis, and at the edge of an A4 page
BIAS_MM = 0.05  # mean error of the corners: a tenth of a sample

MARKERS = {
    number: np.array([[x, y, -900.0], [x + 15, y, -900.0], [x + 15, y - 15, -900.0], [x, y - 15, -900.0]])
    for number, (x, y) in enumerate((x, y) for x in (-100, -40, 30, 90) for y in (-60, 10, 70))
}


def views(axis: RotationAxis, turns, *, noise: float = 0.0, slip: float = 0.0):
    rng = np.random.default_rng(3)
    found = []
    for turn in turns:
        motion = axis.turn(turn * (1 + slip))
        moved = {m: c @ motion[:3, :3].T + motion[:3, 3] for m, c in MARKERS.items()}
        found.append({m: c + rng.normal(0, noise, c.shape) if noise else c for m, c in moved.items()})
    return found


def axis_errors(found: RotationAxis, true: RotationAxis) -> tuple[float, float]:
    """Degrees between two axes, and mm from the found one's point to the true one."""
    sine = np.linalg.norm(np.cross(found.direction, true.direction))
    assert found.direction @ true.direction > 0
    off = found.point - true.point
    return float(np.degrees(np.arcsin(sine))), float(np.linalg.norm(off - true.direction * (off @ true.direction)))


def unit(*vector: float) -> np.ndarray:
    return np.array(vector) / np.linalg.norm(vector)


@settings(deadline=None, max_examples=50)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-950, -850)),
    st.lists(st.integers(-18, 18).map(lambda k: 10.0 * k), min_size=1, max_size=4),
)
def test_any_axis_is_recovered_exactly(direction, point, turns) -> None:
    assume(np.linalg.norm(direction) > 0.1)
    assume(any(turn % 180 for turn in turns))
    axis = RotationAxis(np.array(point), unit(*direction))
    fit = axis_of_corners(views(axis, [0.0, *turns]), [0.0, *turns])
    degrees, off = axis_errors(fit.axis, axis)
    assert degrees < EXACT * 100
    assert off < EXACT * 100
    assert fit.rms_mm < EXACT


def test_noise_of_the_corners_is_averaged_and_reported() -> None:
    axis = RotationAxis(np.array([5.0, -3.0, -910.0]), unit(0.02, 1.0, 0.1))
    turns = [-20.0, 0.0, 20.0]
    fit = axis_of_corners(views(axis, turns, noise=NOISE_MM), turns)
    degrees, off = axis_errors(fit.axis, axis)
    assert degrees < 0.1
    assert off < 3 * NOISE_MM
    assert fit.rms_mm == pytest.approx(NOISE_MM * np.sqrt(6), rel=0.3)


def test_wrong_angles_of_the_stage_are_reported() -> None:
    axis = RotationAxis(np.array([0.0, 0.0, -900.0]), unit(0, 0.1, 1))
    with pytest.raises(BadInput, match=r"turned the board by 99\.00° when it was set to 90\.00°"):
        axis_of_corners(views(axis, [0.0, 90.0], slip=0.1), [0.0, 90.0])


@pytest.mark.parametrize("turns", [[0.0], [0.0, 2.0], [10.0, 370.0], [0.0, 180.0]])
def test_views_that_do_not_determine_an_axis_are_rejected(turns) -> None:
    axis = RotationAxis(np.array([0.0, 0.0, -900.0]), unit(0, 0, 1))
    with pytest.raises(BadInput, match="which way"):
        axis_of_corners(views(axis, turns), turns)


def test_one_marker_in_common_is_rejected() -> None:
    axis = RotationAxis(np.array([0.0, 0.0, -900.0]), unit(0, 0, 1))
    first, second = views(axis, [0.0, 90.0])
    with pytest.raises(BadInput, match="1 markers of the board in common"):
        axis_of_corners([first, {0: second[0]}], [0.0, 90.0])


@pytest.mark.slow
def test_the_axis_of_a_simulated_turntable_is_recovered(board) -> None:
    found = board_corners(board.scans[0])
    off = np.concatenate([found[m] - board.truths[0].surface(board.truths[0].markers[m]) for m in found])
    assert np.abs(off.mean(axis=0)).max() < BIAS_MM
    fit = fit_axis(board.scans, board.turns)
    degrees, mm = axis_errors(fit.axis, board.axis)
    assert degrees < AXIS_DEG
    assert mm < AXIS_MM


@pytest.mark.slow
def test_every_view_has_its_angle(board) -> None:
    with pytest.raises(BadInput, match="1 angles"):
        fit_axis(board.scans, [0.0])


def test_a_page_without_markers_is_rejected(book) -> None:
    with pytest.raises(BadInput, match="no marker"):
        board_corners(book.scans[0])

"""A body's geometry comes back from what it sees of plates, and the uncertainty that is told is the true one."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.scanner import SettingsError
from drivers.vivid900.calibrating.board import Board, detect_board
from drivers.vivid900.calibrating.bundle_adjustment import MARKER_PX, PRIOR, PlateShot, unknowns_of_calibration
from drivers.vivid900.calibrating.calibrate import CalibrationResult, calibrate
from drivers.vivid900.geometry.calibration import Calibration, nominal
from drivers.vivid900.geometry.lenses import FINE, LENSES, texture_grid
from drivers.vivid900.geometry.triangulation import pitch_at, points_of, project, tangents
from oracles.hidden_body import HIDDEN_BODY

MIDDLE = nominal(LENSES["MIDDLE"])
BOARD = Board()
SIZE = np.array([BOARD.columns, -BOARD.rows]) * BOARD.pitch_mm
LINES, PIXELS = 0.03, 0.04  # noise of the samples and the markers here
SIGMAS = 4.0  # one in 16,000 lies farther out
POSES = [(distance, *tilt) for distance in (700, 900, 1200) for tilt in ((0, 0), (25, 0), (0, 25), (-20, -15))]


def shot(distance: float, tilt: float, turn: float, random, *, bare: bool = False, front: bool = False) -> PlateShot:
    """A board (the plane that it lies in, when `bare`) centred on the axis, as HIDDEN_BODY sees it."""
    rotation = Rotation.from_euler("xy", [tilt, turn], degrees=True).as_matrix()
    shift = np.array([0, 0, -distance - HIDDEN_BODY.pupil_mm]) - rotation[:, :2] @ SIZE / 2
    xy = texture_grid(FINE)
    sight = tangents(HIDDEN_BODY, xy)
    rays = np.concatenate([sight, np.full((480, 640, 1), -1.0)], axis=-1)
    depth = (rotation[:, 2] @ shift) / (rays @ rotation[:, 2])
    pitch = pitch_at(HIDDEN_BODY.baseline_mm / depth, HIDDEN_BODY, FINE, distance) + random.normal(
        0, LINES, depth.shape
    )
    place = (rays * depth[..., None] - shift) @ rotation[:, :2] / SIZE
    seen = np.abs(pitch - xy[..., 1] - 62) < 44
    seen &= bare | ((place > 0) & (place < 1)).all(axis=-1)
    some = np.zeros_like(seen)
    some[::20, ::20] = True
    front_mm = distance if front else None
    if bare:
        return PlateShot(xy[seen & some], pitch[seen & some], FINE, distance, front_mm=front_mm)
    places = np.stack([BOARD.centre(marker) for marker in range(BOARD.columns * BOARD.rows)])
    pixels = project(HIDDEN_BODY, places @ rotation[:, :2].T + shift)
    inside = ((pixels > 5) & (pixels < [634, 474])).all(axis=1)
    pixels = pixels[inside] + random.normal(0, PIXELS, (inside.sum(), 2))
    return PlateShot(xy[seen & some], pitch[seen & some], FINE, distance, pixels, places[inside], front_mm)


def shots(seed: int = 0) -> list[PlateShot]:
    random = np.random.default_rng(seed)
    boards = [shot(*pose, random, front=pose[1:] == (0, 0)) for pose in POSES]
    return [*boards, shot(1000, 3, 2, random, bare=True)]


def field_error(found: Calibration, distance: float, off_focus: float = 0.0) -> np.ndarray:
    """(480, 640, 3) mm by which points are wrong, `off_focus` lines from the middle of the window."""
    pitch = np.arange(480.0)[:, None] + 62 + off_focus + np.zeros((1, 640))
    return points_of(pitch, found, FINE, distance) - points_of(pitch, HIDDEN_BODY, FINE, distance)


def length(error: np.ndarray) -> float:
    return float(np.linalg.norm(error, axis=-1).max())


@pytest.fixture(scope="module")
def found() -> CalibrationResult:
    return calibrate(shots(), MIDDLE)


def test_the_hidden_geometry_is_recovered(found: CalibrationResult) -> None:
    off = np.abs(unknowns_of_calibration(found.calibration) - unknowns_of_calibration(HIDDEN_BODY)) / np.array(
        list(found.sigma.values())
    )
    assert dict(zip(PRIOR, off, strict=True)) == {name: pytest.approx(0, abs=SIGMAS) for name in PRIOR}
    assert found.sigma["baseline_mm"] < 0.05
    assert found.sigma["focal_px"] < 0.5
    assert found.sigma["k1"] < 0.003
    assert found.sigma["pupil_mm"] < 0.5


@pytest.mark.parametrize("distance", [600.0, 900.0, 1200.0])
@pytest.mark.parametrize("off_focus", [-40.0, 0.0, 40.0])
def test_points_are_right_all_over_the_field(found: CalibrationResult, distance: float, off_focus: float) -> None:
    assert length(field_error(MIDDLE, distance, off_focus)) > 3.0
    assert length(field_error(found.calibration, distance, off_focus)) < SIGMAS * found.expected_mm
    assert found.expected_mm < 0.6


def test_the_shape_of_things_is_right_to_hundredths(found: CalibrationResult) -> None:
    """What is left is mostly a common turn of the whole scene, which no scan of its own shows."""
    here = points_of(np.arange(480.0)[:, None] + 62 + np.zeros((1, 640)), HIDDEN_BODY, FINE, 900.0).reshape(-1, 3)[::97]
    there = here + field_error(found.calibration, 900.0).reshape(-1, 3)[::97]
    centred = here - here.mean(axis=0)
    turn, _ = Rotation.align_vectors(centred, there - there.mean(axis=0))
    assert np.linalg.norm(turn.apply(there - there.mean(axis=0)) - centred, axis=1).max() < 0.03
    first, second = np.random.default_rng(0).integers(len(here), size=(2, 500))
    true, reported = (np.linalg.norm(one[first] - one[second], axis=1) for one in (here, there))
    off = np.abs(reported - true)[true > 50.0] / true[true > 50.0]
    assert off.max() < SIGMAS * found.expected_length
    assert found.expected_length * np.ptp(here[:, 0]) < 0.3 * found.expected_mm  # a turn changes no length


def test_residuals_are_the_noise_of_the_shots(found: CalibrationResult) -> None:
    assert found.lines == pytest.approx(LINES, rel=0.03)
    assert found.markers_px == pytest.approx(PIXELS * np.sqrt(2), rel=0.05)


@pytest.mark.slow
def test_outliers_do_no_harm() -> None:
    random, spoilt = np.random.default_rng(5), []
    for one in shots():
        struck = random.random(len(one.pitch)) < 0.02
        pixels = one.pixels.copy()
        pixels[:1] += 5.0
        spoilt.append(replace(one, pitch=one.pitch + struck * random.uniform(-3, 3, len(struck)), pixels=pixels))
    found = calibrate(spoilt, MIDDLE)
    assert length(field_error(found.calibration, 900.0)) < SIGMAS * found.expected_mm
    assert found.expected_mm < 0.8


def test_what_the_shots_do_not_show_stays_uncertain() -> None:
    random = np.random.default_rng(1)
    found = calibrate([shot(d, 2, 3, random, bare=True) for d in (800, 900, 1000)], MIDDLE)
    assert found.sigma["focal_px"] > 0.5 * PRIOR["focal_px"]
    assert found.sigma["baseline_mm"] > 0.5 * PRIOR["baseline_mm"]
    assert found.expected_mm > 3.0
    assert found.expected_length > 0.005
    assert np.isnan(found.markers_px)


def test_shots_that_say_nothing_are_refused() -> None:
    with pytest.raises(SettingsError, match="no captures"):
        calibrate([], MIDDLE)
    one = shot(900, 0, 0, np.random.default_rng(0))
    with pytest.raises(SettingsError, match="next to nothing"):
        calibrate([replace(one, texture_xy=one.texture_xy[:50], pitch=one.pitch[:50])], MIDDLE)


def test_a_printed_board_is_found_where_it_is() -> None:
    board, dpi = Board(columns=7, rows=5, marker_mm=20.0, pitch_mm=26.0), 254.0  # ten pixels a millimetre
    picture = board.picture(dpi)
    assert picture.shape == (1360, 1880)
    shrink = np.array([[0.3, 0.02, 40.0], [-0.03, 0.29, 60.0]])
    soft = cv2.GaussianBlur(picture, (0, 0), 2.0)  # of ten thirds of a pixel: what the lens and a pixel's area blur
    seen = cv2.warpAffine(soft, shrink, (640, 480), flags=cv2.INTER_LINEAR, borderValue=255)
    detected = detect_board(cv2.cvtColor(seen, cv2.COLOR_GRAY2RGB), board)
    assert detected is not None
    assert len(detected.pixels) == 7 * 5
    margin = board.pitch_mm - board.marker_mm + board.marker_mm / 2
    printed = (detected.on_board * [1, -1] + margin) * 10 - 0.5
    wanted = printed @ shrink[:, :2].T + shrink[:, 2]
    assert np.sqrt(((detected.pixels - wanted) ** 2).mean()) < MARKER_PX
    middle, corner = wanted.mean(axis=0), np.array([1.0, 1.0])
    assert detected.area(np.stack([middle, corner])).tolist() == [True, False]


def test_a_picture_without_markers_shows_no_board() -> None:
    assert detect_board(np.full((480, 640, 3), 200, np.uint8), Board()) is None

"""Merged shots against the simulator's truth."""

from collections.abc import Sequence

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.simulated import Flat, Markers, Pose, White
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.optics import measure_pitch, trace_rays
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import place_sheet
from drivers.vivid900.capture.merge import OUTLIER_LINES, average, cover_depths, merge_depths
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FAST, LENSES
from drivers.vivid900.geometry.triangulation import lines_of_sight, pitch_of, points_of
from restore.scan import Floats, Mask

MIDDLE = LENSES["MIDDLE"]
SPREAD = 0.03  # relative error of a ratio of two σ from 40,000 samples correlated by 0.3, with room for four of its own
ROUNDING = 1e-9  # lines
SIGHT = 1e-12  # tangents


class View:
    """A page before the scanner, sighted once and shot as often as wanted."""

    def __init__(self, artwork, *, page_mm=(280.0, 200.0), pose: Pose | None = None, table="dark") -> None:
        self.body = nominal(MIDDLE)
        depth = 900 + MIDDLE.pupil_mm
        scene = place_sheet(Flat(), printed(artwork, page_mm), depth_mm=depth, pose=pose, table=table)
        caster = RayCaster(scene.vertices, scene.faces)
        self.truth = trace_rays(scene, caster, FaceMaps.of(scene), self.body, FAST, depth)
        on_page = np.isfinite(self.truth.flat[..., 0]).astype(np.uint8)
        self.paper: Mask = cv2.erode(on_page, np.ones((7, 7)), borderValue=0) > 0

    def shoot(self, seed: int, distance: float = 900.0) -> Floats:
        """(rows, cols) pitch."""
        return measure_pitch(self.truth, self.body, FAST, distance, np.random.default_rng(seed))

    def error(self, pitch: Floats, distance: float = 900.0) -> Floats:
        """(rows, cols) lines by which a shot is wrong."""
        return (pitch - pitch_of(self.truth.points, self.body, FAST, distance)) * FAST.step


@pytest.fixture(scope="module")
def markers() -> View:
    return View(Markers())


@pytest.fixture(scope="module")
def repeated(markers: View) -> list[Floats]:
    return [markers.shoot(seed) for seed in range(4)]


@pytest.mark.parametrize("shots", [2, 4, 9])
def test_noise_falls_with_the_root_of_the_shots(shots: int) -> None:
    view = View(White())
    taken = [view.shoot(seed) for seed in range(shots)]
    one, several = (np.nanstd(view.error(pitch)[view.paper]) for pitch in (taken[0], average(taken, FAST)))
    assert one / several == pytest.approx(np.sqrt(shots), rel=SPREAD)


def test_outliers_are_left_out_and_drop_outs_filled(markers: View, repeated: list[Floats]) -> None:
    mean = average(repeated, FAST)
    far_off = [(np.abs(markers.error(pitch)) > 1.5 * OUTLIER_LINES).sum() for pitch in (*repeated, mean)]
    assert min(far_off[:4]) > 50
    assert far_off[4] < 3  # an outlier that is the only one to see its sample stays
    lost = [(np.isnan(pitch) & markers.paper).sum() for pitch in (*repeated, mean)]
    assert lost[4] < min(lost[:4]) / 20
    assert np.isfinite(mean)[np.isfinite(repeated).sum(axis=0) == 1].all()


def test_faint_ink_gains_as_much_as_paper(markers: View, repeated: list[Floats]) -> None:
    ink = markers.paper & (markers.truth.signal < 0.1) & np.isfinite(repeated).all(axis=0)
    errors = (markers.error(pitch)[ink] for pitch in (repeated[0], average(repeated, FAST)))
    one, four = (np.percentile(np.abs(error), 68) for error in errors)  # outliers at the edges of the ink aside
    assert ink.sum() > 1000
    assert one / four == pytest.approx(2, rel=4 * SPREAD)


@settings(deadline=None)
@given(order=st.permutations(range(4)))
def test_the_order_of_the_shots_does_not_matter(repeated: list[Floats], order: Sequence[int]) -> None:
    some = [pitch[100:140] for pitch in repeated]
    np.testing.assert_allclose(average(some, FAST), average([some[i] for i in order], FAST), atol=ROUNDING)


@pytest.mark.parametrize(
    ("shots", "mean"),
    [
        ([5.0], 5.0),
        ([5.0, np.nan], 5.0),
        ([np.nan, np.nan], np.nan),
        ([5.0, 5.1], 5.05),
        ([5.0, 6.0], np.nan),  # who of the two is right?
        ([5.0, 6.0, 5.1], 5.05),
        ([5.0, 5.1, np.nan, 7.0], 5.05),
    ],
)
def test_by_hand(shots: list[float], mean: float) -> None:
    np.testing.assert_allclose(average([np.full((1, 1), pitch) for pitch in shots], FAST), mean)


@pytest.fixture(scope="module")
def deep() -> View:
    """A page tilted through three windows."""
    return View(White(), page_mm=(150.0, 240.0), pose=Pose(tilt_deg=50), table="none")


@pytest.fixture(scope="module")
def windows(deep: View) -> list[tuple[int, Floats]]:
    def shoot(distance: int) -> Floats:
        return points_of(deep.shoot(distance, distance), deep.body, FAST, distance)

    return cover_depths(shoot, 900, MIDDLE, FAST)


def lines_off(view: View, points: Floats) -> Floats:
    """(rows, cols) lines by which points are wrong."""
    return MIDDLE.focal_px * view.body.baseline_mm * (1 / -points[..., 2] - 1 / -view.truth.points[..., 2])


def test_focus_steps_measure_the_whole_of_a_deep_page(deep: View, windows: list[tuple[int, Floats]]) -> None:
    points = merge_depths(windows, deep.body, FAST)
    assert len(windows) == 3
    seen = [np.isfinite(shot[..., 2])[deep.paper].mean() for _, shot in windows]
    assert max(seen) < 0.6
    assert np.isfinite(points[..., 2])[deep.paper].mean() > 0.998  # one in a thousand is lost wherever it lies
    assert np.nanmax(np.abs(lines_off(deep, points)[deep.paper])) < 6 * MIDDLE.line_noise
    sight = lines_of_sight(deep.body, FAST).tangents[deep.paper]
    found = (points[..., :2] / -points[..., 2:])[deep.paper]
    np.testing.assert_allclose(found[np.isfinite(found[:, 0])], sight[np.isfinite(found[:, 0])], atol=SIGHT)


def test_where_windows_overlap_both_shots_count(deep: View, windows: list[tuple[int, Floats]]) -> None:
    both = deep.paper & (np.stack([np.isfinite(shot[..., 2]) for _, shot in windows]).sum(axis=0) == 2)
    assert both.sum() > 500
    merged = np.std(lines_off(deep, merge_depths(windows, deep.body, FAST))[both])
    single = np.nanstd(np.stack([lines_off(deep, shot)[both] for _, shot in windows]))
    assert merged < 0.85 * single  # the root of one half where both lie alike


def test_a_stray_of_another_window_is_left_out(deep: View, windows: list[tuple[int, Floats]]) -> None:
    strayed = [(distance, points * (1.0 if k else 1.01)) for k, (distance, points) in enumerate(windows)]
    inner = np.isfinite(windows[0][1][..., 2]) & np.isfinite(windows[1][1][..., 2])
    merged = merge_depths(strayed, deep.body, FAST)[inner]
    apart = np.minimum(*(np.abs(merged - shot[inner]).max(axis=1) for _, shot in strayed[:2]))
    assert apart.max() < ROUNDING

"""Fused shots against the simulator's truth."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.scanner import SettingsError
from drivers.simulated import Flat, Markers, Pose, White
from drivers.simulated.facemaps import FaceMaps
from drivers.simulated.optics import Sighting, expose, look
from drivers.simulated.raycast import RayCaster
from drivers.simulated.scene import lay
from drivers.simulated.shot import printed
from drivers.vivid900.calibration import nominal
from drivers.vivid900.fusion import OVERLAP, average, focus_distances, merge_depths
from drivers.vivid900.lenses import FAST, FINE, LENSES, depth_window, texture_grid
from drivers.vivid900.triangulation import lines_of_sight, points_of
from restore.scan import Floats, RangeScan

MIDDLE = LENSES["MIDDLE"]
FAR_OFF_LINES = 0.4  # 18 sigmas of paper: what the fusion calls an outlier
SPREAD = 0.03  # relative error of a ratio of two σ from 40,000 samples correlated by 0.3, with room for four of its own
ROUNDING_MM = 1e-9


def z_error(scan: RangeScan, truth: Sighting) -> Floats:
    return (scan.points - truth.points)[..., 2]


def on_paper(truth: Sighting) -> np.ndarray:
    """Samples well inside the page."""
    return cv2.erode(np.isfinite(truth.flat[..., 0]).astype(np.uint8), np.ones((7, 7)), borderValue=0) > 0


class View:
    """A page before the scanner, sighted once and shot as often as wanted, without colour."""

    def __init__(self, artwork, *, page_mm=(280.0, 200.0), pose: Pose | None = None, table="dark") -> None:
        self.body = nominal(MIDDLE)
        depth = 900 + MIDDLE.pupil_mm
        scene = lay(Flat(), printed(artwork, page_mm), depth_mm=depth, pose=pose, table=table)
        caster = RayCaster(scene.vertices, scene.faces)
        self.truth = look(scene, caster, FaceMaps.of(scene), self.body, FAST, depth)

    def shoot(self, seed: int, distance: float = 900.0) -> RangeScan:
        pitch = expose(self.truth, self.body, FAST, distance, np.random.default_rng(seed))
        texture = np.random.default_rng(seed).normal(200, 1.5, (480, 640, 3)).astype(np.uint8)
        noted = {"lens": "MIDDLE", "mode": "fast", "distance_mm": distance}
        return RangeScan(points_of(pitch, self.body, FAST, distance), texture, texture_grid(FAST), noted)


@pytest.fixture(scope="module")
def repeated() -> tuple[list[RangeScan], Sighting]:
    view = View(Markers())
    return [view.shoot(seed) for seed in range(9)], view.truth


@pytest.fixture(scope="module")
def deep() -> tuple[list[RangeScan], Sighting]:
    """A page tilted through three windows, shot at the distances that cover it."""
    view = View(White(), page_mm=(150.0, 240.0), pose=Pose(tilt_deg=50), table="none")
    reach = 120 * np.sin(np.radians(50))
    distances = focus_distances(MIDDLE, FAST, 900 - reach, 900 + reach)
    assert len(distances) == 3
    return [view.shoot(seed, distance) for seed, distance in enumerate(distances)], view.truth


@pytest.mark.parametrize("shots", [2, 4, 9])
def test_noise_falls_with_the_root_of_the_shots(shots: int) -> None:
    view = View(White())
    taken = [view.shoot(seed) for seed in range(shots)]
    paper = on_paper(view.truth)
    one, several = (np.nanstd(z_error(scan, view.truth)[paper]) for scan in (taken[0], average(taken)))
    assert one / several == pytest.approx(np.sqrt(shots), rel=SPREAD)


def test_outliers_are_left_out_and_drop_outs_filled(repeated) -> None:
    scans, truth = repeated
    fused = average(scans[:4])
    limit = FAR_OFF_LINES * MIDDLE.line_mm(900)
    far_off = [np.abs(z_error(scan, truth)) > 1.5 * limit for scan in (*scans[:4], fused)]
    assert min(mask.sum() for mask in far_off[:4]) > 50
    assert far_off[4].sum() < 3  # two outliers that agree by chance are a majority of three shots
    paper = on_paper(truth)
    lost = [(~scan.measured & paper).sum() for scan in (*scans[:4], fused)]
    assert lost[4] < min(lost[:4]) / 20
    once = np.stack([scan.measured for scan in scans[:4]]).sum(axis=0) == 1
    assert fused.measured[once].all()


def test_faint_ink_gains_as_much_as_paper(repeated) -> None:
    scans, truth = repeated
    faint = np.mean([~scan.measured for scan in scans], axis=0)
    ink = on_paper(truth) & (faint > 0.2) & (np.stack([s.measured for s in scans[:4]]).sum(axis=0) == 4)
    error = [z_error(scan, truth)[ink] for scan in (scans[0], average(scans[:4]))]
    spread = [np.percentile(np.abs(e), 68) for e in error]  # outliers at the edges of the ink aside
    assert ink.sum() > 1000
    assert spread[0] / spread[1] == pytest.approx(2, rel=4 * SPREAD)


def test_the_average_keeps_the_lines_of_sight_and_tells_its_number(repeated) -> None:
    scans, _ = repeated
    fused = average(scans[:4])
    sight = lines_of_sight(nominal(MIDDLE), FAST).tangents
    np.testing.assert_allclose(
        (fused.points[..., :2] / -fused.points[..., 2:])[fused.measured], sight[fused.measured], atol=1e-12
    )
    assert fused.provenance["averaged"] == 4
    assert fused.texture.dtype == np.uint8
    noise = [np.std(s.texture.astype(float) - scans[8].texture) for s in (scans[0], fused)]
    assert noise[1] < 0.85 * noise[0]  # σ·√(1 + 1/4) against σ·√2, and rounding


@given(order=st.permutations(range(4)))
def test_the_order_of_the_shots_does_not_matter(repeated, order: list[int]) -> None:
    scans = [replace(scan, points=scan.points[100:140], texture_xy=scan.texture_xy[100:140]) for scan in repeated[0]]
    one, other = average(scans[:4]), average([scans[i] for i in order])
    np.testing.assert_allclose(one.points, other.points, atol=ROUNDING_MM)


def test_one_shot_is_its_own_average(repeated) -> None:
    scan = repeated[0][0]
    np.testing.assert_allclose(average([scan]).points, scan.points, atol=ROUNDING_MM)


def test_shots_that_contradict_each_other_give_nothing(repeated) -> None:
    scan = repeated[0][0]
    moved = scan.points.copy()
    at = tuple(np.argwhere(scan.measured)[1000])
    moved[at] *= 1.02
    fused = average([repeated[0][1], replace(scan, points=moved)])
    assert repeated[0][1].measured[at]
    assert not fused.measured[at]


def test_focus_steps_measure_the_whole_of_a_deep_page(deep) -> None:
    scans, truth = deep
    fused = merge_depths(scans)
    paper = on_paper(truth)
    assert max(scan.measured[paper].mean() for scan in scans) < 0.6
    assert fused.measured[paper].mean() > 0.998  # one in a thousand is lost wherever it lies
    lines = z_error(fused, truth)[paper] * MIDDLE.focal_px * 250 / truth.points[..., 2][paper] ** 2
    assert np.nanmax(np.abs(lines)) < 6 * MIDDLE.line_noise
    both = paper & (np.stack([scan.measured for scan in scans]).sum(axis=0) == 2)
    assert both.sum() > 500
    error = z_error(fused, truth)[both] * MIDDLE.focal_px * 250 / truth.points[..., 2][both] ** 2
    assert np.nanstd(error) < 0.95 * MIDDLE.line_noise
    assert fused.provenance["distances_mm"] == [scan.provenance["distance_mm"] for scan in scans]


@given(
    lens=st.sampled_from(sorted(LENSES)),
    mode=st.sampled_from([FINE, FAST]),
    ends=st.tuples(st.floats(500, 2500), st.floats(500, 2500)).map(sorted),
)
def test_focus_steps_cover_the_depth_and_overlap(lens: str, mode, ends: list[float]) -> None:
    optics = LENSES[lens]
    windows = [depth_window(optics, mode, d) for d in focus_distances(optics, mode, *ends)]
    assert windows[0][0] <= (ends[0] + optics.pupil_mm) * (1 + 1e-9)
    assert windows[-1][1] >= (ends[1] + optics.pupil_mm) * (1 - 1e-9)
    for near, far in zip(windows[1:], windows[:-1], strict=True):
        shared, whole = 1 / near[0] - 1 / far[1], 1 / far[0] - 1 / far[1]
        assert shared >= OVERLAP * whole * (1 - 1e-9)


def test_what_cannot_be_fused_is_refused(repeated) -> None:
    scans, _ = repeated
    with pytest.raises(SettingsError, match="no scans"):
        average([])
    with pytest.raises(SettingsError, match="different grids"):
        average([scans[0], replace(scans[1], points=scans[1].points[:100])])
    with pytest.raises(SettingsError, match="one place"):
        average([scans[0], replace(scans[1], points=scans[1].points + [0.1, 0.0, 0.0])])
    with pytest.raises(SettingsError, match="distance_mm"):
        merge_depths([scans[0], replace(scans[1], provenance={"lens": "MIDDLE", "mode": "fast"})])
    with pytest.raises(SettingsError, match="no range"):
        focus_distances(MIDDLE, FINE, 900.0, 800.0)

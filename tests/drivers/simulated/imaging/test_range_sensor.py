"""The range sensor against the manual's figures (VIVID 910 hardware manual) and the geometry of its triangle."""

from collections.abc import Callable

import numpy as np
import pytest

from drivers.simulated import (
    Binding,
    Crumpled,
    Curl,
    Figure,
    Flat,
    Markers,
    Miura,
    MultiFold,
    Pose,
    Spread,
    Wave,
    White,
    shoot,
)
from drivers.simulated.imaging.optics import NOISE_FLOOR_SIGNAL, OUTLIER_LINES, edges, line_noise
from drivers.simulated.imaging.raycast import RayCaster
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import BASELINE_MM, FAST, FINE, LENSES, depth_window
from restore.scan import Floats, Mask

Shoot = Callable[..., object]

PRECISION_MM = {"TELE": 0.008, "MIDDLE": 0.016, "WIDE": 0.032}  # p. 56: 1σ in z, FINE, 0.6 m
SPREAD = 0.02  # relative error of a σ estimated from 100,000 samples correlated by 0.3, with room for four of its own σ
CORRELATION = 0.01  # four standard errors of a correlation over 300,000 samples
CHORD_MM = 4e-4  # strips of 0.25 mm lie this close to the tightest bend
SIGHT = 1e-12
CREASED = (Miura(), MultiFold(), Crumpled())
SMOOTH = (Spread(), Binding(), Wave(), Curl())


def inner(mask: Mask, rim: int) -> Mask:
    """True where no sample within `rim` is False."""
    import cv2

    return cv2.erode(mask.astype(np.uint8), np.ones((2 * rim + 1,) * 2), borderValue=0) > 0


def z_error(shot) -> Floats:
    return shot.points[..., 2] - shot.hits.points[..., 2]


@pytest.mark.parametrize("sheet", CREASED + SMOOTH, ids=lambda sheet: sheet.name)
def test_exact_points_lie_on_the_page_where_the_truth_says(range_shot: Shoot, sheet) -> None:
    shot = range_shot(sheet, White(), pose=Pose(tilt_deg=8, turn_deg=5, shift_mm=(3, -4, 6)), mode="fast")
    page, seen = shot.on_page, np.isfinite(shot.exact[..., 2])
    assert page.sum() > 0.5 * page.size
    truth = shot.scene.surface(shot.hits.flat[page & seen])
    np.testing.assert_allclose(shot.exact[page & seen], truth, atol=CHORD_MM)


def test_noise_moves_points_along_their_lines_of_sight_only(range_shot: Shoot) -> None:
    shot = range_shot(Binding(), Markers())
    points = shot.points[shot.measured]
    np.testing.assert_allclose(points[:, :2] / -points[:, 2:], shot.sight[shot.measured], atol=SIGHT)
    assert np.nanstd(z_error(shot)) > 0


@pytest.mark.parametrize("lens", LENSES)
def test_precision_on_white_paper_is_the_manuals(range_shot: Shoot, lens: str) -> None:
    shot = range_shot(Flat(), White(), lens=lens, distance=600.0, page=(400.0, 300.0))
    error = z_error(shot)[inner(shot.on_page, 3)]
    assert np.nanstd(error) == pytest.approx(PRECISION_MM[lens], rel=SPREAD)
    assert abs(np.nanmean(error)) < PRECISION_MM[lens] / 50


def test_noise_grows_with_the_square_of_the_depth(range_shot: Shoot) -> None:
    near, far = (range_shot(Flat(), White(), distance=d, page=(600.0, 500.0)) for d in (600.0, 1200.0))
    sigma = [np.nanstd(z_error(shot)) for shot in (near, far)]
    assert sigma[1] / sigma[0] == pytest.approx((1221.5 / 621.5) ** 2, rel=SPREAD)


def test_noise_is_correlated_along_the_stripe_only() -> None:
    noise = line_noise((480, 640), np.random.default_rng(0))
    assert noise.std() == pytest.approx(1, abs=CORRELATION)
    for rows, cols, wanted in ((0, 1, 0.3), (0, 2, 0.0), (1, 0, 0.0), (1, 1, 0.0)):
        here, there = noise[rows:, cols:], noise[: 480 - rows, : 640 - cols]
        assert np.corrcoef(here.ravel(), there.ravel())[0, 1] == pytest.approx(wanted, abs=CORRELATION)


def patch(shot, ink: str) -> Mask:
    left, bottom, right, top = shot.scene.printed.patches[ink]
    u, v = np.moveaxis(shot.hits.flat, -1, 0)
    return (u > left + 1) & (u < right - 1) & (v > bottom + 1) & (v < top - 1)  # 1 mm clear of the edge


def test_dark_inks_drop_out_and_red_ones_do_not(range_shot: Shoot) -> None:
    shot = range_shot(Flat(), Figure())
    lost = {ink: 1 - shot.measured[patch(shot, ink)].mean() for ink in shot.scene.printed.patches}
    assert lost["black"] == pytest.approx(1 / 3, abs=0.05)
    assert min(lost[ink] for ink in ("cyan", "green", "blue")) > 0.2
    assert max(lost[ink] for ink in ("magenta", "yellow", "red")) < 0.005
    assert lost["yellow"] < lost["grey"] < 0.05


def test_little_light_means_more_noise(range_shot: Shoot) -> None:
    shot = range_shot(Flat(), Figure())
    black, yellow = (np.nanstd(z_error(shot)[patch(shot, ink)]) for ink in ("black", "yellow"))
    signal = np.median(shot.hits.signal[patch(shot, "black")])
    assert black / yellow == pytest.approx(np.sqrt(NOISE_FLOOR_SIGNAL / signal), rel=0.05)
    assert black / yellow > 2.5


def test_outliers_keep_to_edges(range_shot: Shoot) -> None:
    shot = range_shot(Flat(), Markers(), table="none")
    lens = LENSES["MIDDLE"]
    edge = edges(shot.hits, nominal(lens)) & shot.measured
    lines = np.abs(z_error(shot)) / lens.line_mm(900)
    far_off = lines > 0.5  # 6 σ even on black ink
    assert 0.005 < far_off[edge].mean() < 0.02
    assert not far_off[shot.measured & ~edge].any()
    assert lines[edge].max() < OUTLIER_LINES + 0.5


def test_coated_paper_is_lost_where_it_mirrors_the_laser(range_shot: Shoot) -> None:
    matte, coated = (range_shot(Curl(), White(gloss=gloss)) for gloss in (0.0, 1.0))
    assert matte.measured[matte.on_page].mean() > 0.99
    blind = coated.on_page & ~coated.measured & matte.measured
    assert 0.001 < blind[coated.on_page].mean() < 0.2
    # The mirror of a level page would lie half-way down to the laser: only near there is it blind.
    assert coated.hits.points[blind][:, 1].mean() < -BASELINE_MM / 4


def test_shadows_lie_above_what_stands_up(range_shot: Shoot) -> None:
    gap, page = 25.0, (200.0, 100.0)
    shot = range_shot(Flat(), White(), table="light", gap=gap, page=page)
    dark = ~shot.on_page & (shot.hits.signal == 0)
    assert np.nonzero(dark)[0].max() < np.nonzero(shot.on_page)[0].min() + 1  # nothing below the upper edge
    # Light that grazes the upper edge from the laser below it comes down on the table farther up.
    depth = 900 + LENSES["MIDDLE"].pupil_mm
    y = page[1] / 2 + (page[1] / 2 + BASELINE_MM) * gap / depth
    top = 239.5 - y / (depth + gap) * LENSES["MIDDLE"].focal_px
    middle = np.nonzero(dark[:, 320])[0]
    assert middle.min() == pytest.approx(top, abs=1)
    assert (np.diff(middle) == 1).all()


def test_a_wall_that_turns_from_the_laser_is_dark(range_shot: Shoot) -> None:
    # The lens sees both sides of this ridge, the upper one by 8° only; the laser, 15° farther down, is behind it.
    ridge = MultiFold(creases=((0.0, 0.0, -140.0),))
    shot = range_shot(ridge, White(), pose=Pose(turn_deg=90, tilt_deg=12), page=(160.0, 160.0), table="none")
    up, lit = shot.hits.flat[..., 0], shot.hits.signal > 0
    assert (up > 80).sum() > 1000
    assert lit[up < 79].all()
    assert not lit[up > 81].any()


@pytest.mark.parametrize("mode", [FINE, FAST], ids=lambda mode: mode.name)
def test_only_the_depth_window_is_measured(range_shot: Shoot, mode) -> None:
    shot = range_shot(Flat(), White(), pose=Pose(tilt_deg=50), page=(280.0, 330.0), mode=mode.name, table="none")
    near, far = depth_window(LENSES["MIDDLE"], mode, 900)
    seen = -shot.exact[..., 2][np.isfinite(shot.exact[..., 2])]
    step = 1.5  # depth from one row of samples to the next on this slope
    assert seen.min() == pytest.approx(near, abs=step * mode.step)
    assert seen.max() == pytest.approx(far, abs=step * mode.step)
    assert -np.nanmax(shot.hits.points[..., 2]) < near - 10
    assert -np.nanmin(shot.hits.points[..., 2]) > far + 10


def test_the_window_follows_the_focus(range_shot: Shoot) -> None:
    shot = range_shot(Flat(), White(), distance=900.0, focus=700.0)
    assert not shot.measured.any()


def test_tables(range_shot: Shoot) -> None:
    shots = {table: range_shot(Flat(), White(), table=table) for table in ("none", "dark", "light")}
    off = {table: shot.measured[inner(~shot.on_page & (shot.hits.signal > 0), 2)] for table, shot in shots.items()}
    assert off["none"].size == 0
    assert 0.7 < off["dark"].mean() < 0.97
    assert off["light"].mean() > 0.99
    z = z_error(shots["dark"])
    assert np.nanstd(z[inner(~shots["dark"].on_page, 3)]) > 1.5 * np.nanstd(z[inner(shots["dark"].on_page, 3)])


def test_laser_power_decides_what_is_measured(range_shot: Shoot) -> None:
    weak, strong = (range_shot(Flat(), White(), exposure=e, mode="fast", table="none") for e in (0.02, 8.0))
    assert weak.measured[weak.on_page].mean() < 0.3
    assert not strong.measured.any()  # saturated


def test_a_shot_repeats_with_its_seed(range_shot: Shoot) -> None:
    first, again, other = (range_shot(Wave(), Markers(), seed=s, mode="fast") for s in (3, 3, 4))
    np.testing.assert_array_equal(first.points, again.points)
    assert not np.array_equal(first.measured, other.measured)


def test_a_page_out_of_sight_gives_an_empty_scan() -> None:
    scan, truth = shoot(Flat(), White(), mode="fast", table="none", pose=Pose(shift_mm=(900.0, 0.0, 0.0)))
    assert not scan.measured.any()
    assert np.isnan(truth.flat).all()
    assert scan.texture.max() < 40


def test_faces_out_of_range_never_reach_the_ray_caster() -> None:
    with pytest.raises(ValueError, match="vertices 0 to 2"):
        RayCaster(np.eye(3), np.array([[0, 1, 3]]))
    with pytest.raises(ValueError, match="faces"):
        RayCaster(np.eye(3), np.empty((0, 3), int))

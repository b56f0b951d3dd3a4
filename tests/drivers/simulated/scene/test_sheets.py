"""Every sheet is a sheet of paper: it keeps all lengths, hangs together, and can be seen whole from above."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.scanner import SettingsError
from drivers.simulated import White
from drivers.simulated.scene.scene import place_sheet
from drivers.simulated.scene.sheets import (
    SHEETS,
    Binding,
    Cone,
    Crumpled,
    Curl,
    Flat,
    Miura,
    MultiFold,
    Opening,
    Sheet,
    Spread,
    Wave,
)

PAGE = (280.0, 200.0)
BENT = (
    Flat(),
    Curl(),
    Curl(radius_mm=-120.0, taper=0.0, angle_deg=90.0),
    Binding(),
    Spread(),
    Opening(offset_mm=13, right_deg=30.0),
    Wave(),
    Cone(),
)
FOLDED = (
    MultiFold(),
    Miura(),
    Miura(side_mm=30.0, fold_deg=50.0),
    Crumpled(),
    Crumpled(seed=1),
    Crumpled(seed=2, planes=8),
)
STEP_MM = 1e-3  # of the differences: their own error is curvature² · step² / 6, below 1e-9
METRIC = 1e-8  # what rounding of positions of 100 mm (1e-14) leaves over such a step
ROUNDING_MM = 1e-9
CHORD = 6e-6  # a ruling every 0.25 mm on the tightest bend, 0.046 per mm, shortens it by (0.25 · 0.046)² / 24
STEEP_DEG = 66.0


def named(sheet: Sheet) -> str:
    return sheet.name


def metric_error(sheet: Sheet) -> float:
    """Greatest deviation of the metric tensor from the identity, at the middle of every face wide enough."""
    paper, faces = sheet.mesh(PAGE)
    middle = paper[faces].mean(axis=1)
    reach = np.linalg.norm(paper[faces] - middle[:, None], axis=2)
    area = np.abs(np.linalg.det((paper[faces] - paper[faces][:, :1])[:, 1:])) / 2
    middle = middle[area / reach.max(axis=1) > 10 * STEP_MM][::7]
    right, up = (
        (sheet.warp(middle + step, PAGE) - sheet.warp(middle - step, PAGE)) / (2 * STEP_MM)
        for step in (np.array([STEP_MM, 0]), np.array([0, STEP_MM]))
    )
    products = [(right * right).sum(1) - 1, (up * up).sum(1) - 1, (right * up).sum(1)]
    return float(np.abs(products).max())


@pytest.mark.parametrize("sheet", BENT + FOLDED, ids=named)
def test_metric_tensor_is_the_identity(sheet: Sheet) -> None:
    assert metric_error(sheet) < METRIC


def test_metric_tensor_sees_a_stretch() -> None:
    class Stretched(Wave):
        def warp(self, paper, page_mm):
            return super().warp(paper, page_mm) * [1.0, 1.0001, 1.0]

    assert metric_error(Stretched()) > 1e-4


@pytest.mark.parametrize("sheet", BENT + FOLDED, ids=named)
def test_no_two_points_move_apart(sheet: Sheet) -> None:
    # Within a convex page the straight way is the shortest on paper, so none of its ends can be farther apart in space:
    # a tear or a stretch anywhere between them would show.
    a, b = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 4000, 2)) * PAGE
    b[2000:] = a[2000:] + np.random.default_rng(1).normal(0, 0.1, (2000, 2))  # and at close range, across creases
    apart = np.linalg.norm(sheet.warp(a, PAGE) - sheet.warp(b, PAGE), axis=1)
    assert (apart <= np.linalg.norm(a - b, axis=1) + ROUNDING_MM).all()


@pytest.mark.parametrize("sheet", BENT + FOLDED, ids=named)
def test_mesh_covers_the_page_once(sheet: Sheet) -> None:
    paper, faces = sheet.mesh(PAGE)
    areas = np.linalg.det((paper[faces] - paper[faces][:, :1])[:, 1:]) / 2
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(PAGE[0] * PAGE[1], rel=1e-9)
    assert (np.abs(paper) <= np.array(PAGE) / 2 + ROUNDING_MM).all()


@pytest.mark.parametrize("sheet", BENT + FOLDED, ids=named)
def test_mesh_edges_keep_their_length(sheet: Sheet) -> None:
    paper, faces = sheet.mesh(PAGE)
    space = sheet.warp(paper, PAGE)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    flat, warped = (np.linalg.norm(p[edges[:, 0]] - p[edges[:, 1]], axis=1) for p in (paper, space))
    np.testing.assert_allclose(warped, flat, rtol=CHORD if sheet in BENT else 0, atol=ROUNDING_MM)


@pytest.mark.parametrize("sheet", BENT + FOLDED, ids=named)
def test_every_face_looks_up(sheet: Sheet) -> None:
    paper, faces = sheet.mesh(PAGE)
    a, b, c = np.moveaxis(sheet.warp(paper, PAGE)[faces], 1, 0)
    assert np.cross(b - a, c - a)[:, 2].min() > 0


@pytest.mark.parametrize("sheet", FOLDED, ids=named)
def test_no_part_covers_another(sheet: Sheet) -> None:
    paper, faces = sheet.mesh(PAGE)
    a, b, c = np.moveaxis(sheet.warp(paper, PAGE)[faces][..., :2], 1, 0)
    points = np.random.default_rng(0).uniform(-0.55, 0.55, (3000, 1, 2)) * PAGE
    left = [
        (q - p)[:, 0] * (points - p)[..., 1] - (q - p)[:, 1] * (points - p)[..., 0] > 0
        for p, q in ((a, b), (b, c), (c, a))
    ]
    assert np.logical_and.reduce(left).sum(axis=1).max() == 1


@pytest.mark.slow
@given(
    slope=st.floats(5, 75),
    wavelength=st.floats(40, 400),
    angle=st.floats(-180, 180),
    width=st.floats(60, 420),
    height=st.floats(60, 420),
)
@settings(deadline=None, max_examples=30)
def test_waves_of_any_kind_cover_pages_of_any_size(
    slope: float, wavelength: float, angle: float, width: float, height: float
) -> None:
    sheet, page = Wave(slope_deg=slope, wavelength_mm=wavelength, angle_deg=angle), (width, height)
    paper, faces = sheet.mesh(page)
    areas = np.linalg.det((paper[faces] - paper[faces][:, :1])[:, 1:]) / 2
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(width * height, rel=1e-9)
    assert np.isfinite(sheet.warp(paper, page)).all()


def test_walls_of_the_gutter_have_the_slope_asked_for() -> None:
    sheet, step = Spread(slope_deg=STEEP_DEG), 1e-6
    left, spine, right = sheet.warp(np.array([[-step, 0], [0, 0], [step, 0]]), PAGE)
    for rise in (left - spine, right - spine):
        assert np.degrees(np.arctan2(rise[2], abs(rise[0]))) == pytest.approx(STEEP_DEG, abs=1e-3)  # it falls by 2e-6 °


def test_folds_turn_by_the_angles_asked_for() -> None:
    sheet = MultiFold(creases=((-40.0, 10.0, 35.0), (50.0, -5.0, -60.0)))
    paper, faces = sheet.mesh(PAGE)
    middles = paper[faces].mean(axis=1)
    a, b, c = np.moveaxis(sheet.warp(paper, PAGE)[faces], 1, 0)
    normals = np.cross(b - a, c - a)[np.argsort(middles[:, 0])]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    turns = np.degrees(np.arccos(np.clip((normals[:-1] * normals[1:]).sum(1), -1, 1)))
    np.testing.assert_allclose(sorted(turns)[-2:], [35, 60], atol=1e-6)


def test_a_miura_sheet_folds_in_two_directions() -> None:
    sheet = Miura()
    x, y = (
        np.linspace(-0.5, 0.5, 200)[:, None] * PAGE * np.array([1, 0]),
        np.linspace(-0.5, 0.5, 200)[:, None] * PAGE * np.array([0, 1]),
    )
    for line in (x, y):
        bends = np.linalg.norm(np.diff(sheet.warp(line, PAGE), 2, axis=0), axis=1)
        assert (bends > 1e-3).sum() >= 3  # creases crossed by a line over the page


def test_a_crumple_repeats_with_its_seed() -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (100, 2)) * PAGE
    np.testing.assert_array_equal(Crumpled(seed=5).warp(points, PAGE), Crumpled(seed=5).warp(points, PAGE))
    assert np.ptp(Crumpled(seed=5).warp(points, PAGE) - Crumpled(seed=6).warp(points, PAGE)) > 1


@pytest.mark.parametrize("seed", range(8))
def test_a_crumple_is_rough_and_stays_within_its_slope(seed: int) -> None:
    sheet = Crumpled(seed=seed)
    paper, faces = sheet.mesh(PAGE)
    space = sheet.warp(paper, PAGE)
    a, b, c = np.moveaxis(space[faces], 1, 0)
    normals = np.cross(b - a, c - a)
    slopes = np.degrees(np.arccos(normals[:, 2] / np.linalg.norm(normals, axis=1)))
    assert slopes.max() < sheet.steep_deg + 5  # levelling turns the whole sheet by a few degrees
    assert len(faces) > 100
    assert 10 < np.ptp(space[:, 2]) < 80  # a crumpled page of the 2008 paper was 65 mm deep


@pytest.mark.parametrize(
    "sheet",
    [Curl(radius_mm=60.0), MultiFold(creases=((-40.0, 0.0, 120.0), (40.0, 0.0, 120.0))), Cone(opening_deg=12.0)],
    ids=named,
)
def test_a_sheet_that_hides_from_the_scanner_is_refused(sheet: Sheet) -> None:
    with pytest.raises(SettingsError, match="folds over itself"):
        place_sheet(sheet, White().print_on(PAGE), depth_mm=900)


@pytest.mark.parametrize(
    "creases",
    [((-40.0, 40.0, 20.0), (10.0, -40.0, 20.0)), ((50.0, 0.0, 20.0), (-50.0, 0.0, 20.0)), ((500.0, 0.0, 20.0),)],
)
def test_creases_that_meet_are_refused(creases: tuple) -> None:
    with pytest.raises(SettingsError, match="creases"):
        MultiFold(creases=creases).mesh(PAGE)


def test_every_sheet_goes_by_its_name() -> None:
    assert {name: kind.name for name, kind in SHEETS.items()} == {name: name for name in SHEETS}

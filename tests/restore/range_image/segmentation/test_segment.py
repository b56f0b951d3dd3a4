"""The sheet is segmented whole, without table and debris."""

from dataclasses import replace

import numpy as np
import pytest

from restore.camera.rays import find_rays
from restore.errors import NotEnoughSurface
from restore.range_image.segmentation.segment import (
    CLOSING_DIAMETER,
    MAX_LOST,
    MAX_LOST_ON_TABLE,
    MIN_FRACTION,
    fill_outline,
    find_pieces,
    find_sheet,
    segment,
)

PAPER, INK = (232, 228, 218), (38, 36, 40)
TABLES = {"dark": (62, 58, 55), "light": (165, 150, 132)}
TABLE_MM = 921.5
MIN_RECALL = 0.98  # of the sheet's: noise and the colour cloud's tail of 1 % take the others
MIN_AREA_RECALL = 0.995  # of the sheet, once its holes are filled and its notches closed
MAX_OVERSHOOT = 2  # samples past the true outline: colour is read between two texture pixels


def colour_noise(picture, seed=0):
    noisy = np.asarray(picture, float) + np.random.default_rng(seed).normal(0, 3.0, np.shape(picture))
    return np.clip(noisy, 0, 255).astype(np.uint8)


def on_paper(camera):
    """A picture of nothing but paper."""
    return colour_noise(np.full((*camera.shape, 3), PAPER))


def sheet_area(camera, *, turn_deg=0.0, width=130.0, height=90.0):
    """(rows, cols) True on a rectangle of so many samples in the middle of the picture."""
    across, along = camera.about_ridge(turn_deg, (camera.cols - 1) / 2)
    return (np.abs(across) <= width / 2) & (np.abs(along) <= height / 2)


def printed(area, camera):
    """(rows, cols) True in lines of words on a sheet: 3 samples high, a margin of 10 round them."""
    rows, cols = (grid.astype(int) for grid in camera.indices)
    words = (rows % 8 < 3) & (cols % 11 < 8) & (np.random.default_rng(1).random(camera.cols)[cols] > 0.2)
    return words & np.roll(area, 10, 0) & np.roll(area, -10, 0) & np.roll(area, 10, 1) & np.roll(area, -10, 1)


def scene(camera, area, inverse_depth, table, *, ink=None):
    """A sheet in its area, the table round it, under the scanner's noise and the camera's."""
    tabletop = camera.plane((0.1, 0.05, 1.0), TABLE_MM)
    depth = np.where(area, inverse_depth, tabletop) + np.random.default_rng(2).normal(0, camera.noise, camera.shape)
    colours = np.where(area[..., None], PAPER, TABLES.get(table, PAPER))
    colours = np.where((area & ink)[..., None], INK, colours) if ink is not None else colours
    return camera.shot(depth, colour_noise(colours))


def curled(camera):
    """A curl that touches the table in the middle of the picture and rises 10 mm from it."""
    return camera.cylinder(150.0, distance=TABLE_MM - 5.0, hollow=True)


def find(scan):
    sheet = find_sheet(scan, find_rays(scan))
    return sheet.samples, sheet.inside


def assert_is(inside, area):
    assert (inside & area).sum() >= MIN_AREA_RECALL * area.sum()
    beyond = inside & ~outline_grown(area, MAX_OVERSHOOT)
    assert not beyond.any()


def outline_grown(area, by):
    grown = area.copy()
    for _ in range(by):
        grown[1:] |= grown[:-1].copy()
        grown[:-1] |= grown[1:].copy()
        grown[:, 1:] |= grown[:, :-1].copy()
        grown[:, :-1] |= grown[:, 1:].copy()
    return grown


@pytest.mark.parametrize("turn_deg", [0.0, 25.0])
@pytest.mark.parametrize("shape", ["flat", "curled"])
@pytest.mark.parametrize("table", TABLES)
def test_a_sheet_is_segmented_from_the_table(camera, table, shape, turn_deg):
    area = sheet_area(camera, turn_deg=turn_deg)
    surface = curled(camera) if shape == "curled" else camera.plane((0.1, 0.05, 1.0), TABLE_MM)  # in the same plane
    samples, inside = find(scene(camera, area, surface, table, ink=printed(area, camera)))
    assert_is(inside, area)
    assert not (samples & ~outline_grown(area, MAX_OVERSHOOT)).any()


@pytest.mark.parametrize("shape", ["flat", "curled"])
def test_without_a_table_all_measured_samples_are_sheet(camera, shape):
    area = sheet_area(camera, turn_deg=25.0)
    surface = np.where(area, curled(camera) if shape == "curled" else camera.plane(), np.nan)
    samples, inside = find(camera.shot(surface, on_paper(camera)))
    np.testing.assert_array_equal(samples, area)
    assert_is(inside, area)


@pytest.mark.parametrize("ink", [False, True], ids=["blank", "printed"])
@pytest.mark.parametrize("shape", ["flat", "curled"])
def test_a_page_that_fills_the_picture_is_not_segmented_as_table(camera, shape, ink):
    everywhere = np.ones(camera.shape, bool)
    words = printed(everywhere, camera) if ink else np.zeros(camera.shape, bool)
    surface = curled(camera) if shape == "curled" else camera.plane((0.1, 0.05, 1.0))
    samples, inside = find(scene(camera, everywhere, surface, "dark", ink=words))
    assert samples.all()
    assert (~inside).sum() <= 4 * CLOSING_DIAMETER  # its corners are rounded off


def test_without_colour_the_table_is_segmented_by_its_plane(camera):
    area = sheet_area(camera)
    raised = camera.plane((0.1, 0.05, 1.0), TABLE_MM - 10.0)
    scan = replace(scene(camera, area, raised, "dark"), texture=None)
    assert_is(find(scan)[1], area)


def test_a_spread_of_two_pages_stays_whole(camera):
    """An open book, whose gutter lies on the table between walls of 60°."""
    area = sheet_area(camera, width=150.0)
    gutter = 2 * camera.plane((0.0, 0.0, 1.0), TABLE_MM).max() - camera.roof(120.0, 0.0, 99.5)
    gutter = np.minimum(gutter, camera.plane((0.0, 0.0, 1.0), TABLE_MM - 20.0))
    samples, inside = find(scene(camera, area, gutter, "dark", ink=printed(area, camera)))
    assert_is(inside, area)
    assert samples[area].mean() > MIN_RECALL - printed(area, camera)[area].mean()


@pytest.mark.parametrize("table", [None, "dark"])
def test_drop_outs_inside_ink_are_filled(camera, table):
    area = sheet_area(camera)
    words = printed(area, camera)
    scan = scene(camera, area if table else np.ones(camera.shape, bool), curled(camera), table, ink=words)
    lost = words if table else words | ~area
    scan = replace(scan, points=np.where(lost[..., None], np.nan, scan.points))
    samples, inside = find(scan)
    assert not samples[words].any()
    assert inside[words].all()
    assert_is(inside, area)


def without(scan, lost):
    return replace(scan, points=np.where(lost[..., None], np.nan, scan.points))


def strips(camera, width):
    """Columns and rows, so many beside each other, as a sensor's fault or ruled lines leave them."""
    rows, cols = (grid.astype(int) - 15 for grid in camera.indices)
    return (rows % 30 < width) | (cols % 30 < width)


@pytest.mark.parametrize(("table", "width"), [("dark", MAX_LOST_ON_TABLE), ("light", 5), (None, MAX_LOST)])
def test_lost_rows_and_columns_do_not_part_a_sheet(camera, table, width):
    area = sheet_area(camera, turn_deg=0.0 if table else 25.0, width=125.0)
    shot = scene(camera, area, curled(camera), table) if table else camera.shot(np.where(area, curled(camera), np.nan))
    scan = without(shot, strips(camera, width))
    samples, inside = find(scan)
    ends = outline_grown(~area, width) & area  # a strip may have taken the border itself
    assert inside[area & ~ends].all()
    assert not (samples & strips(camera, width)).any()
    assert not (inside & ~outline_grown(area, MAX_OVERSHOOT)).any()
    assert len(find_pieces(scan, find_rays(scan))) == 1


@pytest.mark.parametrize("table", TABLES)
def test_samples_lost_at_random_leave_the_sheet_whole(camera, table):
    area = sheet_area(camera, turn_deg=25.0)
    lost = np.random.default_rng(4).random(camera.shape) < 0.4
    samples, inside = find(without(scene(camera, area, curled(camera), table), lost))
    within = area & ~outline_grown(~area, 1)  # what was lost at the border is lost
    assert (inside & within).sum() >= MIN_AREA_RECALL * within.sum()
    assert not (inside & ~outline_grown(area, MAX_OVERSHOOT)).any()
    assert not (samples & lost).any()


def test_a_sheet_in_the_shadow_of_another_is_not_one_with_it(camera):
    """The laser stands to the left of the lens by 0.27 of the distance, as far as the VIVID 910's above it."""
    _, cols = camera.indices
    front = cols < 100
    step_mm = 5.0
    shadow = ~front & (cols < 100 + 0.27 * step_mm / camera.pitch_mm)
    depth = np.where(
        front, camera.cylinder(300.0, distance=TABLE_MM - step_mm), camera.cylinder(300.0, distance=TABLE_MM)
    )
    scan = camera.shot(np.where(shadow, np.nan, depth), on_paper(camera))
    assert 2 <= shadow[0].sum() <= MAX_LOST
    assert len(find_pieces(scan, find_rays(scan))) == 2


def test_two_sheets_on_a_table_are_two(camera):
    """As near to each other as one sample of the table."""
    left, right = (np.roll(sheet_area(camera, width=60.0), by, 1) for by in (-35, 35))
    scan = scene(camera, left | right, curled(camera), "dark")
    assert len(find_pieces(scan, find_rays(scan))) == 2
    (found,) = find_sheet(scan, find_rays(scan)).scan.findings
    assert "another surface as large as a page" in found.text


def test_one_sheet_is_not_warned_of(camera):
    scan = scene(camera, sheet_area(camera), curled(camera), "dark")
    assert find_sheet(scan, find_rays(scan)).scan.findings == ()


def test_a_second_sheet_behind_a_depth_step_is_left_out(camera):
    _, cols = camera.indices
    depth = np.where(cols < 120, camera.cylinder(150.0), camera.cylinder(150.0, distance=TABLE_MM + 25.0))
    samples, inside = find(camera.shot(depth, on_paper(camera)))
    np.testing.assert_array_equal(samples, cols < 120)
    assert not inside[:, 120:].any()


def test_the_steepest_measurable_walls_do_not_divide_a_sheet(camera):
    samples, _ = find(camera.shot(camera.roof(150.0, 0.0, 100.3), on_paper(camera)))
    assert samples.all()


def small(camera):
    area = np.zeros(camera.shape, bool)
    side = int(np.sqrt(0.9 * MIN_FRACTION * area.size))
    area[40 : 40 + side, 60 : 60 + side] = True
    return area


def comb(camera):
    """Single lines, joined at one end: many samples, but no surface."""
    rows, cols = camera.indices
    return (rows % 12 == 0) | (cols == 0)


def torn(camera):
    """Scraps of 15 × 15 samples with 5 between them: together more than a page, alone none."""
    rows, cols = (grid.astype(int) for grid in camera.indices)
    return (rows % 20 < 15) & (cols % 20 < 15)


@pytest.mark.parametrize("area", [small, comb, torn])
def test_without_a_piece_as_large_as_a_page_not_enough_surface_is_raised(camera, area):
    surface = np.where(area(camera), camera.plane(), np.nan)
    with pytest.raises(NotEnoughSurface, match=r"largest connected surface covers [01]\.\d%"):
        find(camera.shot(surface))


def test_a_bare_table_is_segmented_as_the_sheet(camera):
    """Nothing lies on it that could tell it from a page that fills the picture."""
    bare = np.zeros(camera.shape, bool)
    samples, _ = find(scene(camera, bare, camera.plane(), "dark"))
    assert samples.all()


def test_the_outline_fills_holes_and_closes_notches_and_adds_nothing_outside(camera):
    area = sheet_area(camera, turn_deg=25.0)
    spoilt = area.copy()
    spoilt[70:90, 80:110] = False  # a black picture
    spoilt[75:78, 100:150] = False  # a line of ink that runs to the edge
    spoilt[20:22, 30:33] = True  # debris
    filled = fill_outline(spoilt)
    assert not (filled & ~area).any()
    assert (area & ~filled).sum() <= 4 * CLOSING_DIAMETER  # corners of the sheet are rounded off
    np.testing.assert_array_equal(fill_outline(filled), filled)


def test_specks_along_a_side_leave_no_tips(camera):
    """Runs of samples in the row that an edge runs along, and one or two in the next."""
    area = np.zeros(camera.shape, bool)
    area[40:120, 30:170] = True
    spoilt = area.copy()
    spoilt[39, 50:55] = spoilt[38, 52] = spoilt[39, 80:87] = spoilt[38, 82:84] = spoilt[39, 100] = True
    spoilt[121, 60] = spoilt[120, 58:63] = True
    filled = fill_outline(spoilt)
    assert not filled[:39].any()
    assert not filled[121:].any()
    assert (filled & ~area).sum() <= 5 + 7 + 5


@pytest.mark.parametrize(("scattered", "hint"), [(False, "nearer"), (True, "laser power")])
def test_the_hint_for_too_little_surface_follows_from_its_cause(camera, scattered, hint):
    """A small patch measured whole asks for another distance, single samples all over the picture for more light."""
    rows, cols = (grid.astype(int) for grid in camera.indices)
    area = (rows % 12 == 0) & (cols % 12 == 0) if scattered else sheet_area(camera, width=20.0, height=12.0)
    with pytest.raises(NotEnoughSurface, match=r"covers \d") as raised:
        find(camera.shot(np.where(area, camera.plane(), np.nan), on_paper(camera)))
    assert hint in raised.value.hint


@pytest.mark.parametrize(("rows", "codes"), [(1, []), (3, ["unconnected"])])
def test_what_lies_beyond_a_strip_that_was_not_measured_is_said_to_be_left_out(camera, rows, codes):
    """A page that fills the picture, with ink along its lower edge that gives no range, and `rows` of paper beyond."""
    ink = np.zeros(camera.shape, bool)
    ink[-rows - 20 : -rows] = True
    scan = without(camera.shot(camera.plane(), on_paper(camera)), ink)
    for sheet in (find_sheet(scan, camera.rays), *find_pieces(scan, camera.rays)):
        assert [one.code for one in sheet.scan.findings] == codes
        assert not sheet.inside[-rows:].any()


@pytest.mark.parametrize(("colour", "codes"), [(TABLES["dark"], []), (PAPER, ["unconnected"])])
def test_a_corner_of_the_table_that_bends_away_is_not_called_a_part_of_the_page(camera, colour, codes):
    """As the table of a body that is read by the manual's figures; paper there would be one."""
    area = sheet_area(camera)
    scan = scene(camera, area, camera.plane(), "dark")
    rows, cols = camera.indices
    corner = (rows < 14) & (cols < 20)
    points = np.where(corner[..., None], 0.98 * scan.points, scan.points)
    texture = np.where(corner[..., None], np.array(colour, np.uint8), scan.texture)
    sheet = find_sheet(replace(scan, points=points, texture=texture), camera.rays)
    assert [one.code for one in sheet.scan.findings] == codes
    assert not (sheet.inside & corner).any()


@pytest.mark.parametrize(("rows", "cols", "share"), [((40, 120), (50, 150), 0.0), ((40, 160), (0, 100), 219 / 436)])
def test_how_much_of_the_border_is_at_the_edge_of_the_picture(camera, rows, cols, share):
    """Which is where the samples end: the scanner gives none in its last rows and columns."""
    area = np.zeros(camera.shape, bool)
    area[slice(*rows), slice(*cols)] = True
    scan = camera.shot(camera.plane())
    assert segment(scan, camera.rays, area).cut == pytest.approx(share, abs=0.02)
    lost = np.ones_like(area)
    lost[3:-3, 3:-3] = False
    assert segment(without(scan, lost), camera.rays, area & ~lost).cut == pytest.approx(share, abs=0.02)

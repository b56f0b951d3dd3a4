"""The table is separated from the sheet by plane, colour and position, and never detected where there is none."""

from dataclasses import replace

import numpy as np
import pytest

from restore.camera.rays import EDGE_BLUR
from restore.range_image.segmentation.surface import BORDER_BAND
from restore.range_image.segmentation.table import find_table

MIN_RECALL = 0.98  # of the table's samples: 1 % of a normal colour cloud lies outside, and four sigmas of noise
MAX_FALSE_FRACTION = 0.005  # of the sheet's samples, along its edge where colours mix
DISTANCE_MM = 921.5  # of the plane
PAPER, TABLE = (232, 228, 218), (62, 58, 55)
NOISY = 7.0  # times the noise of white paper: that of dark ink


def seen(camera, colours, inverse_depth, seed=0):
    random = np.random.default_rng(seed)
    colours = np.clip(colours + random.normal(0, 3.0, colours.shape), 0, 255).astype(np.uint8)
    return camera.shot(inverse_depth + random.normal(0, camera.noise, camera.shape), colours)


def found_in(scan, **options):
    measured = scan.measured
    return find_table(scan, 1.0 / np.where(measured, -scan.points[..., 2], np.nan), measured, **options)


def table_of(scan, **options):
    return found_in(scan, **options).samples


@pytest.fixture
def sheet(camera):
    area = np.zeros(camera.shape, bool)
    area[35:125, 40:160] = True
    return area


@pytest.fixture
def coloured(sheet):
    return np.where(sheet[..., None], PAPER, TABLE).astype(float)


def test_the_table_has_the_plane_and_the_colour_of_the_border(camera, sheet, coloured):
    tilted = camera.plane((0.2, -0.1, 1.0))
    table = table_of(seen(camera, coloured, np.where(sheet, camera.cylinder(90.0, distance=880.0), tilted)))
    assert table[~sheet].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION


def test_a_pixel_is_of_the_table_by_its_fraction_of_the_light(camera, sheet):
    """Light is mixed where paper and table share a pixel; the codes that show it are those of sRGB."""
    linear = [(np.array(colour) / 255.0) ** 2.2 for colour in (PAPER, TABLE)]
    paper, table, mostly_table, mostly_paper = (
        255.0 * (share * linear[0] + (1.0 - share) * linear[1]) ** (1.0 / 2.2) for share in (1.0, 0.0, 0.35, 0.65)
    )
    coloured = np.where(sheet[..., None], paper, table)
    coloured[35:125, 39], coloured[35:125, 160] = mostly_table, mostly_paper
    found = table_of(seen(camera, coloured, camera.plane()))
    assert found[35:125, 39].mean() > MIN_RECALL
    assert found[37:123, 160].mean() < 1.0 - MIN_RECALL


def test_ink_of_the_tables_colour_off_its_plane_is_not_table(camera, sheet, coloured):
    black_picture = np.zeros_like(sheet)
    black_picture[60:100, 70:110] = True
    coloured[black_picture] = TABLE
    table = table_of(seen(camera, coloured, np.where(sheet, camera.plane(distance=900.0), camera.plane())))
    assert not table[black_picture].any()


def test_objects_on_the_table_are_not_table(camera, sheet, coloured):
    """A weight on the border of the picture, out of the plane, and a coloured card that lies in it."""
    weight, card = np.zeros_like(sheet), np.zeros_like(sheet)
    weight[:20, :30] = True
    card[130:, 150:] = True
    coloured[card] = (170, 40, 40)
    surface = np.where(weight, camera.plane(distance=890.0), camera.plane())
    surface = np.where(sheet, camera.plane(distance=905.0), surface)
    table = table_of(seen(camera, coloured, surface))
    assert not table[weight].any()
    assert not table[130 + 2 * EDGE_BLUR :, 150 + 2 * EDGE_BLUR :].any()
    assert table[~sheet & ~weight & ~card].mean() > MIN_RECALL


def test_the_same_scan_has_the_same_table(camera, sheet, coloured):
    scan = seen(camera, coloured, np.where(sheet, camera.cylinder(90.0, distance=880.0), camera.plane()))
    np.testing.assert_array_equal(table_of(scan), table_of(scan))


def scattered(camera):
    return np.random.default_rng(3).random(camera.shape) < 0.4


def columns(camera):
    return camera.indices[1] % 2 == 1


def rows(camera):
    return camera.indices[0] % 2 == 1


@pytest.mark.parametrize("lost", [scattered, columns, rows])
def test_samples_that_were_lost_do_not_hide_the_table(camera, sheet, coloured, lost):
    depths = np.where(sheet, camera.cylinder(90.0, distance=880.0), camera.plane())
    table = table_of(seen(camera, coloured, np.where(lost(camera), np.nan, depths)))
    assert table[~sheet & ~lost(camera)].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION


def curled_to_the_border(camera, sheet, coloured):
    return seen(camera, np.full_like(coloured, PAPER), camera.cylinder(90.0))


def out_of_sight(camera, sheet, coloured):
    """Nothing within BAND of the frame was measured."""
    surface = camera.plane()
    surface[:BORDER_BAND] = surface[-BORDER_BAND:] = np.nan
    surface[:, :BORDER_BAND] = surface[:, -BORDER_BAND:] = np.nan
    return seen(camera, coloured, surface)


def one_colour(camera, sheet, coloured):
    """A page that fills the picture and rises as a ridge, 60° steep, from its flat margins."""
    rows, cols = camera.indices
    from_margin = np.minimum(np.minimum(rows - 35, 124 - rows), np.minimum(cols - 40, 159 - cols))
    height = np.clip(from_margin, 0, 10) * np.tan(np.radians(60.0)) * camera.pitch_mm
    return seen(camera, np.full_like(coloured, PAPER), 1.0 / (1.0 / camera.plane() - height))


def ruled(camera, sheet, coloured):
    """A page that fills the picture, with lines and words on it and nothing else."""
    page = np.full_like(coloured, PAPER)
    page[10:-10:8, 10:-10] = page[11:-10:8, 10:-10] = TABLE
    page[:, 60:62] = TABLE
    return seen(camera, page, camera.plane())


def dark_picture(camera, sheet, coloured):
    """A page that fills the picture, and a figure on it so dark that only its soft edge was measured."""
    black = np.zeros_like(sheet)
    black[37:123, 42:158] = True  # within the sheet's area, by two samples
    page = np.where(coloured == PAPER, TABLE, PAPER)
    return seen(camera, page.astype(float), np.where(black, np.nan, camera.plane()))


def one_side_below(camera, sheet, coloured):
    """Half of a page that fills the picture stands clear of the other, as no table does of a page round it."""
    shown = np.where(camera.indices[1] < 100, camera.cylinder(90.0, distance=900.0), camera.cylinder(90.0))
    return seen(camera, np.full_like(coloured, PAPER), shown)


def panel_in_the_shade(camera, sheet, coloured):
    """A leaflet that fills the picture, one panel in the scanner's plane and darker than the one that rises from it."""
    rise = np.clip(camera.indices[1] - 100, 0, None) * np.tan(np.radians(35.0)) * camera.pitch_mm
    panels = np.where(camera.indices[1][..., None] < 100, (168, 164, 155), PAPER)
    return seen(camera, panels.astype(float), 1.0 / (1.0 / camera.plane() - rise))


def dark_figure(camera, sheet, coloured):
    """A flat page that fills the picture, and a large figure on it, of which every sample was measured."""
    return seen(camera, np.where(sheet[..., None], (90, 60, 50), PAPER).astype(float), camera.plane())


@pytest.mark.parametrize(
    "scan",
    [
        *(curled_to_the_border, out_of_sight, one_colour, one_side_below, ruled, dark_picture),
        *(panel_in_the_shade, dark_figure),
    ],
)
def test_without_a_table_in_view_none_is_detected(camera, sheet, coloured, scan):
    assert not table_of(scan(camera, sheet, coloured)).any()


def test_a_flat_sheet_darker_than_its_table_is_found_by_its_thickness(camera, sheet):
    """Kraft paper, a tenth of a millimetre thick, on a white desk; a figure of its colour on a page is none."""
    for thickness_mm in (0.0, 0.1):
        surface = np.where(sheet, camera.plane(distance=DISTANCE_MM - thickness_mm), camera.plane())
        table = table_of(seen(camera, np.where(sheet[..., None], (170, 130, 90), PAPER).astype(float), surface))
        assert table[~sheet].mean() > (MIN_RECALL if thickness_mm else -1.0)
        assert not table[sheet].any() or table[sheet].mean() < MAX_FALSE_FRACTION
        assert table.any() == (thickness_mm > 0.0)


@pytest.mark.parametrize(("columns", "noises"), [(60, 6.0), (60, 12.0), (140, 8.0), (140, 12.0)])
def test_a_page_at_the_edge_of_the_picture_does_not_tilt_the_table_just_below_it(camera, columns, noises):
    """A plane aslant between the two has more of the samples than the table; the page may have most of the border."""
    page = camera.indices[1] < columns
    raised = camera.plane(distance=DISTANCE_MM - noises * camera.noise * DISTANCE_MM**2)
    colours = np.where(page[..., None], PAPER, TABLE).astype(float)
    table = table_of(seen(camera, colours, np.where(page, raised, camera.plane())))
    assert table[~page].mean() > MIN_RECALL
    assert table[page].mean() < MAX_FALSE_FRACTION


@pytest.mark.parametrize("coloured_scan", [True, False])
@pytest.mark.parametrize("bow_mm", [-0.4, 0.2, 0.4])
def test_a_table_may_be_bowed(camera, sheet, coloured, bow_mm, coloured_scan):
    """By more than the noise of its samples, from the middle of the picture to its sides."""
    right, up = (
        index / (0.5 * (size - 1)) - 1.0 for index, size in zip(camera.indices[::-1], camera.shape[::-1], strict=True)
    )
    bowed = 1.0 / (1.0 / camera.plane() - bow_mm * (right**2 + 0.5 * up**2))
    scan = seen(camera, coloured, np.where(sheet, camera.cylinder(90.0, distance=880.0), bowed))
    table = table_of(scan if coloured_scan else replace(scan, texture=None))
    assert table[~sheet].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION


def test_samples_that_dark_ink_scatters_off_a_page_are_not_a_table(camera):
    """A page that fills the picture, printed here and there at its border, too."""
    ink = np.zeros(camera.shape, bool)
    ink[40:120, 60:140] = ink[:5, 40:160] = ink[:30, :3] = True
    noise = np.random.default_rng(3).normal(0, NOISY * camera.noise, camera.shape)
    colours = np.where(ink[..., None], TABLE, PAPER).astype(float)
    assert not table_of(seen(camera, colours, camera.plane() + np.where(ink, noise, 0.0))).any()


def one_row(camera):
    return camera.indices[0] != 5


def one_column(camera):
    return camera.indices[1] != 5


@pytest.mark.parametrize("lost", [one_row, one_column])
@pytest.mark.parametrize("coloured_scan", [True, False])
@pytest.mark.parametrize("framed", [True, False])
def test_a_single_line_of_samples_has_no_table(camera, coloured, lost, coloured_scan, framed):
    scan = seen(camera, coloured, np.where(lost(camera), np.nan, camera.plane()))
    table = table_of(scan if coloured_scan else replace(scan, texture=None), framed=framed)
    assert not table.any()


def test_the_page_is_distinguished_from_a_table_of_three_colours(camera, sheet):
    """None of them has half of it, and not all of them are found."""
    third = camera.indices[1].astype(int) // 67
    colours = np.array([(40, 60, 110), (150, 30, 30), (60, 120, 60)], float)[third]
    surface = np.where(sheet, camera.cylinder(250.0, distance=DISTANCE_MM - 9.0), camera.plane())
    table = table_of(seen(camera, np.where(sheet[..., None], PAPER, colours), surface))
    assert table[~sheet].mean() > 1.0 / 3.0
    assert not table[sheet].any()


@pytest.mark.parametrize("coloured_scan", [True, False])
@pytest.mark.parametrize("share", [0.05, 0.15])
def test_black_cloth_of_which_little_is_measured_is_a_table(camera, sheet, share, coloured_scan):
    """With three times the noise of paper, which the band has a corner of."""
    page = sheet.copy()
    page[100:, 130:] = True
    lost = ~page & (np.random.default_rng(4).random(camera.shape) > share)
    noise = np.where(page, 0.0, np.random.default_rng(6).normal(0.0, 3.0 * camera.noise, camera.shape))
    depths = np.where(page, camera.plane(distance=905.0), camera.plane() + noise)
    scan = seen(camera, np.where(page[..., None], PAPER, TABLE).astype(float), np.where(lost, np.nan, depths))
    table = table_of(scan if coloured_scan else replace(scan, texture=None))
    assert table[~page & scan.measured].mean() > MIN_RECALL
    assert table[page].mean() < MAX_FALSE_FRACTION


@pytest.fixture
def white(camera):
    """A picture of paper on a table of its own colour."""
    return np.broadcast_to(np.array(PAPER, float), (*camera.shape, 3))


@pytest.mark.parametrize("rise_mm", [4.0, 25.0])
def test_a_table_of_the_papers_colour_is_found_by_the_step_to_a_raised_page(camera, sheet, white, rise_mm):
    page = camera.cylinder(250.0, distance=DISTANCE_MM - rise_mm - 5.0)
    table, touching, *_ = found_in(seen(camera, white, np.where(sheet, page, camera.plane())))
    assert table[~sheet].mean() > MIN_RECALL
    assert not table[sheet].any()
    assert touching == 0.0


def valley(camera):
    """A page that touches the table in a strip from its upper to its lower edge, and rises to both sides."""
    return camera.cylinder(100.0, distance=DISTANCE_MM, hollow=True)


def test_a_strip_that_touches_such_a_table_within_the_page_is_the_pages(camera, sheet, white):
    table, *_ = found_in(seen(camera, white, np.where(sheet, valley(camera), camera.plane())))
    assert table[~sheet].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION


def test_how_much_of_the_outline_touches_such_a_table(camera, sheet, white):
    """A page bent up from the table: its left edge lies on it, 90 of the 416 samples round it, and parts of two."""
    height = 0.02 * np.maximum(camera.indices[1] - 40.0, 0.0) ** 1.5
    bent = 1.0 / (1.0 / camera.plane() - height)
    table, touching, *_ = found_in(seen(camera, white, np.where(sheet, bent, camera.plane())))
    assert 0.2 < touching < 0.35
    assert table[~sheet].mean() > MIN_RECALL


def test_in_a_mesh_the_table_extends_to_the_border_of_the_measured_samples(camera, sheet, coloured):
    """Turned since it was scanned, so that the frame of the picture means nothing."""
    measured, _ = camera.about_ridge(20.0, 99.5)
    outer = (np.abs(measured) < 75) & (np.abs(camera.about_ridge(20.0, 99.5)[1]) < 70)
    raised = np.where(sheet, camera.plane(distance=900.0), camera.plane())
    scan = seen(camera, coloured, np.where(outer, raised, np.nan))
    table = table_of(scan, framed=False)
    assert table[outer & ~sheet].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION


def test_in_a_mesh_a_figure_on_a_flat_page_is_not_a_sheet_on_a_table(camera, sheet, coloured):
    assert not table_of(seen(camera, coloured, camera.plane()), framed=False).any()


def test_without_colour_one_side_of_a_fold_is_not_a_table(camera):
    scan = seen(camera, np.zeros((*camera.shape, 3)), camera.roof(40.0, 0.0, camera.cols * 0.6))
    assert not table_of(replace(scan, texture=None)).any()


def test_without_colour_a_plane_on_all_four_sides_is_the_table(camera, sheet):
    depths = np.where(sheet, camera.cylinder(90.0, distance=880.0), camera.plane())
    table = table_of(replace(seen(camera, np.zeros((*camera.shape, 3)), depths), texture=None))
    assert table[~sheet].mean() > MIN_RECALL
    assert table[sheet].mean() < MAX_FALSE_FRACTION

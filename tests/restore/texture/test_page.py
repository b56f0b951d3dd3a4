"""The page is painted true to scale: every page pixel has the colour of its texture position."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_erosion

from restore.errors import BadInput
from restore.page import FlatMesh
from restore.texture.page import MM_PER_INCH, PAPER, extend_edge_colours, page_map, paint_page, sample, sampling_ppi

DPI = 127.0  # five pixels to the millimetre
MM = DPI / MM_PER_INCH
POSITION_PX = 0.01  # of the texture: single precision keeps a thousandth
ROUNDED = 1.0  # grey levels


def texture(height, width, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)


def rectangle(width_mm, height_mm, count=4):
    """A flat page of count × count cells, flat (n, 2) with its lower left corner somewhere, and its faces."""
    steps = np.linspace(0.0, 1.0, count + 1)
    flat = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * [width_mm, height_mm] + [-37.0, 12.5]
    k = np.arange(count * (count + 1)).reshape(count, count + 1)[:, :-1].ravel()
    faces = np.vstack([np.column_stack([k, k + 1, k + count + 2]), np.column_stack([k, k + count + 2, k + count + 1])])
    return flat, faces


def page_of(image, dpi=DPI, **changes):
    """A page on which the whole image lies, a texture pixel on every page pixel at `dpi`."""
    height, width = image.shape[:2]
    flat, faces = rectangle(width / dpi * MM_PER_INCH, height / dpi * MM_PER_INCH)
    low = flat.min(axis=0)
    texcoords = (flat - low) * [1, -1] * (dpi / MM_PER_INCH) + [0, height] - 0.5
    vertices = np.column_stack([flat, np.full(len(flat), -900.0)])
    fields = {"vertices": vertices, "faces": faces, "texcoords": texcoords, "texture": image, "flat": flat} | changes
    return FlatMesh(**fields)


@pytest.mark.parametrize("shape", [(40, 60), (61, 33)])
def test_the_identity_map_returns_the_texture_bit_for_bit(shape):
    image = texture(*shape)
    painting = paint_page(page_of(image), DPI)
    np.testing.assert_array_equal(painting.image, image)
    assert painting.mask.all()
    rows, cols = np.indices(shape)
    np.testing.assert_allclose(painting.source(), np.dstack([cols, rows]), atol=POSITION_PX)
    assert painting.resolution.sampling_ppi == pytest.approx(DPI)


@settings(max_examples=25, deadline=None)
@given(st.floats(-180, 180), st.floats(0.3, 3.0), st.floats(0.3, 3.0), st.floats(-200, 200), st.floats(-200, 200))
def test_an_affine_map_is_reproduced_to_a_hundredth_of_a_pixel(angle, across, along, x, y):
    flat, faces = rectangle(30.0, 20.0)
    turn = np.deg2rad(angle)
    linear = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) * [across, along]
    source = page_map(flat, faces, flat @ linear.T + [x, y], DPI)
    height, width = source.shape[:2]
    assert (width, height) == (150, 100)
    cols, rows = np.meshgrid(np.arange(width), np.arange(height))
    upper_left = np.array([flat[:, 0].min(), flat[:, 1].max()])
    place = upper_left + np.dstack([cols + 0.5, -(rows + 0.5)]) / MM
    np.testing.assert_allclose(source, place @ linear.T + [x, y], atol=POSITION_PX)


@pytest.mark.parametrize("width_mm, height_mm, pixels", [(30.0, 20.0, (150, 100)), (30.09, 19.91, (150, 100))])
def test_the_picture_ends_with_the_last_pixels_on_the_page(width_mm, height_mm, pixels):
    flat, faces = rectangle(width_mm, height_mm)
    source = page_map(flat, faces, flat, DPI)
    assert source.shape == (*pixels[::-1], 2)
    assert np.isfinite(source).all()


@pytest.mark.parametrize("width", [90, 91, 92, 93])
def test_a_coarse_page_of_any_size_has_a_mask_of_its_own_size(width):
    for dpi in (DPI / 2, DPI / 3.4, DPI / 1.3):
        painting = paint_page(page_of(texture(61, width)), dpi)
        assert painting.mask.shape == painting.source().shape[:2] == painting.image.shape[:2]


def test_a_page_coarser_than_its_texture_is_the_mean_of_its_pixels():
    image = texture(60, 90)
    for factor in (2, 3):
        painting = paint_page(page_of(image), DPI / factor)
        blocks = image.reshape(60 // factor, factor, 90 // factor, factor, 3).mean(axis=(1, 3))
        assert np.abs(painting.image - blocks).max() <= ROUNDED
        assert painting.mask.shape == painting.source().shape[:2] == painting.image.shape[:2]
        of_its_block = factor * np.array([7, 5]) + factor // 2
        np.testing.assert_allclose(painting.source()[5, 7], of_its_block, atol=POSITION_PX)
        assert painting.resolution.sampling_ppi == pytest.approx(DPI)


def test_a_parabolic_texture_is_interpolated_exactly():
    """Bilinear interpolation would stay a grey level below it."""
    x = np.arange(40.0)
    image = np.tile((4 * (x % 10 - 5) ** 2)[None, :, None], (10, 1, 3)).astype(np.uint8)
    at = np.arange(13.0, 18.0, 0.25)
    found = sample(image, np.stack(np.meshgrid(at, [4.0, 5.5]), axis=-1).astype(np.float32))
    np.testing.assert_allclose(found[..., 0], [np.round(4 * (at - 15) ** 2)] * 2, atol=0.5)


def test_the_border_of_the_texture_is_replicated_and_off_the_page_it_is_white():
    image = texture(6, 6)
    found = sample(image, np.array([[[-5, 2], [np.nan, np.nan], [9, 9]]], np.float32))
    np.testing.assert_array_equal(found[0, [0, 2]], [image[2, 0], image[5, 5]])
    np.testing.assert_array_equal(found[0, 1], PAPER)


def test_off_the_page_the_picture_is_white_and_unmasked():
    image = texture(60, 60)
    page = page_of(image)
    half = page.faces[(page.flat[page.faces].mean(axis=1) - page.flat.mean(axis=0)).sum(axis=1) < 0]
    painting = paint_page(page_of(image, faces=half), DPI)
    assert 0.3 < painting.mask.mean() < 0.7
    np.testing.assert_array_equal(painting.image[~painting.mask], PAPER)
    whole = binary_erosion(painting.mask)
    np.testing.assert_array_equal(painting.image[whole], image[whole])
    assert np.isnan(painting.source()[~painting.mask]).all()


def test_the_edge_pixels_of_the_sheet_are_not_mixed_with_the_table():
    """Half of such a pixel is table; the sheet's own colour is carried on to its edge and past it."""
    sheet = np.full((60, 90, 3), 30, np.uint8)
    sheet[10:50, 20:70] = 220
    sheet[9:51, [19, 70]] = sheet[[9, 50], 19:71] = 125
    page = page_of(sheet[9:51, 19:71])
    painting = paint_page(replace(page, texture=sheet, texcoords=page.texcoords + [19, 9]), DPI)
    np.testing.assert_array_equal(painting.image, 220)


def test_the_sampling_ppi_is_the_median_over_the_paper():
    flat, faces = rectangle(60.0, 20.0, count=3)
    pixels = flat * [8.0, 2.0]  # four pixels to the millimetre, in the mean of both directions
    assert sampling_ppi(flat, faces, pixels) == pytest.approx(4.0 * MM_PER_INCH)
    assert sampling_ppi(flat, faces[:, ::-1], pixels * [-1, 1]) == pytest.approx(4.0 * MM_PER_INCH)
    edge = flat[:, 0].min() + 40.0
    beyond = np.maximum(flat[:, 0] - edge, 0.0)
    for stretch in (-7.9, 40.0):  # the last third is a wall that the camera saw edge-on, or a tag that came near it
        other = pixels + np.column_stack([stretch * beyond, 0 * beyond])
        assert sampling_ppi(flat, faces, other) == pytest.approx(4.0 * MM_PER_INCH)


@pytest.mark.parametrize("without", ["texture", "texcoords"])
def test_a_page_without_texture_shows_its_relief(without):
    """A roof, lit from the upper left: the left slope is brighter than the right, and nothing but grey."""
    page = page_of(texture(40, 60), **{without: None})
    middle = page.flat[:, 0].mean()
    page.vertices[:, 2] -= 0.5 * np.abs(page.flat[:, 0] - middle)
    painting = paint_page(page, DPI)
    assert painting.image.shape == (40, 60, 3)
    assert painting.resolution.resolved_ppi == 0.0
    assert np.isnan(painting.source()).all()
    assert painting.mask.all()
    np.testing.assert_array_equal(painting.image[..., 0], painting.image[..., 2])
    slope = np.arctan(0.5)
    light = np.array([-0.4, 0.4, 0.825])
    bright, dark = (PAPER * (light @ [sign * np.sin(slope), 0, np.cos(slope)]) for sign in (-1, 1))
    assert painting.image[20, 5, 0] == pytest.approx(bright, abs=2.0)
    assert painting.image[20, 55, 0] == pytest.approx(dark, abs=2.0)


def test_a_page_too_large_for_any_memory_is_bad_input_that_names_the_unit():
    flat, faces = rectangle(3e6, 2e6)
    with pytest.raises(BadInput, match=r"15000000 × 10000000 pixels") as caught:
        page_map(flat, faces, flat, DPI)
    assert "unit" in caught.value.hint


@pytest.mark.parametrize("mixed_pixels", [0, 1, 3])
def test_beyond_the_band_that_is_mixed_with_the_table_every_pixel_has_the_nearest_colour_of_the_sheet(mixed_pixels):
    picture, (left, right) = texture(24, 30), (8, 25)
    texcoords = np.array([[left, 5.0], [right, 5.0], [right, 40.0], [left, 40.0]])  # goes on below the picture
    extended = extend_edge_colours(picture, texcoords, np.array([[0, 1, 2], [0, 2, 3]]), mixed_pixels=mixed_pixels)
    rows, cols = np.indices(picture.shape[:2])
    nearest = np.maximum(rows, 5 + mixed_pixels), np.clip(cols, left + mixed_pixels, right - mixed_pixels)
    np.testing.assert_array_equal(extended, picture[nearest])

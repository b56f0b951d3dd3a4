"""Pictures of a scan."""

import numpy as np
import pytest
import tifffile
from PIL import Image

from restore.errors import BadInput
from restore.formats import read_image
from restore.formats.parsing import picture
from restore.formats.parsing.picture import encode_png

PAINT = np.arange(5 * 7 * 3, dtype=np.uint8).reshape(5, 7, 3)


@pytest.mark.parametrize("name", ["a.png", "a.ppm", "a.tif", "a.bmp"])
def test_lossless_kinds_come_back_exactly(tmp_path, name):
    Image.fromarray(PAINT).save(tmp_path / name)
    np.testing.assert_array_equal(read_image(tmp_path / name), PAINT)


def test_a_png_of_ours_comes_back_exactly(tmp_path):
    (tmp_path / "a.png").write_bytes(encode_png(PAINT))
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), PAINT)


def test_grey_palette_and_transparency_become_rgb(tmp_path):
    grey = np.arange(256, dtype=np.uint8).reshape(16, 16)
    for mode in ("L", "P", "LA", "RGBA"):
        Image.fromarray(grey).convert(mode).save(tmp_path / "a.png")
        np.testing.assert_array_equal(read_image(tmp_path / "a.png"), np.dstack([grey] * 3))


def test_sixteen_bits_of_grey_keep_their_upper_eight(tmp_path):
    Image.fromarray(np.array([[0, 257, 65535]], dtype=np.uint16)).save(tmp_path / "a.png")
    assert read_image(tmp_path / "a.png")[0, :, 0].tolist() == [0, 1, 255]


GREY = np.linspace(0, 65535, 24).astype(np.uint16).reshape(4, 6)


@pytest.mark.parametrize("kind, order", [("minisblack", "<"), ("minisblack", ">"), ("miniswhite", "<")])
def test_grey_of_sixteen_bits_in_tiff(tmp_path, kind, order):
    tifffile.imwrite(tmp_path / "a.tif", GREY, photometric=kind, byteorder=order)
    expected = GREY // 257 if kind == "minisblack" else 255 - GREY // 257
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif"), np.dstack([expected] * 3))


def test_separate_planes_of_eight_bits_in_tiff(tmp_path):
    planes = np.moveaxis(PAINT, -1, 0).copy()
    tifffile.imwrite(tmp_path / "a.tif", planes, photometric="rgb", planarconfig="separate")
    np.testing.assert_array_equal(read_image(tmp_path / "a.tif"), PAINT)


@pytest.mark.parametrize(
    "values, options, fault",
    [
        ((GREY / 65535).astype(np.float32), {"photometric": "minisblack"}, "grey in other numbers"),
        (GREY.astype(np.uint32), {"photometric": "minisblack"}, "grey in other numbers"),
        (GREY.astype(np.int16), {"photometric": "minisblack"}, "grey in other numbers"),
        (np.stack([GREY] * 3), {"photometric": "rgb", "planarconfig": "separate"}, "separate planes of 16 bits"),
    ],
    ids=["float", "32 bits", "signed", "planes of 16 bits"],
)
def test_numbers_that_cannot_be_read_are_refused(tmp_path, values, options, fault):
    tifffile.imwrite(tmp_path / "a.tif", values, **options)
    with pytest.raises(BadInput, match=rf"a\.tif .*{fault}"):
        read_image(tmp_path / "a.tif")


def test_a_picture_with_too_many_pixels_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(picture, "MAX_PIXELS", 30)
    Image.fromarray(PAINT).save(tmp_path / "a.png")
    with pytest.raises(BadInput, match=r"a\.png has too many pixels: 7 × 5"):
        read_image(tmp_path / "a.png")


def test_a_small_file_of_many_pixels_of_one_colour_is_refused(tmp_path):
    Image.new("RGB", (6000, 6000)).save(tmp_path / "a.png")
    with pytest.raises(BadInput, match=r"a\.png has too many pixels: 6000 × 6000"):
        read_image(tmp_path / "a.png")


def test_a_picture_of_several_bands_comes_back_exactly(tmp_path):
    paint = np.random.default_rng(1).integers(0, 256, (3 * picture.BAND_ROWS + 1, 2, 3)).astype(np.uint8)
    Image.fromarray(paint).save(tmp_path / "a.png")
    np.testing.assert_array_equal(read_image(tmp_path / "a.png"), paint)


@pytest.mark.parametrize("kind", ["a.png", "a.jpg", "a.tif", "a.bmp", "a.ppm"])
def test_a_cut_picture_is_reported(tmp_path, kind):
    paint = np.random.default_rng(1).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    Image.fromarray(paint).save(tmp_path / kind)
    (tmp_path / kind).write_bytes((tmp_path / kind).read_bytes()[:-600])
    with pytest.raises(BadInput, match=rf"{kind} seems cut short"):
        read_image(tmp_path / kind)


@pytest.mark.parametrize("data", [b"no picture", b"GIF89a" + b"\0" * 50])
def test_damage_is_named(tmp_path, data):
    (tmp_path / "a.png").write_bytes(data)
    with pytest.raises(BadInput, match=r"a\.png is not a readable image"):
        read_image(tmp_path / "a.png")

"""Photographs as cameras, phones and scanning programs write them."""

import io
import sys
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from restore import BadInput, Photograph
from restore.errors import LibraryMissing
from restore.photo import read_photograph, register_photographs
from restore.photo.photograph import FILM_DIAGONAL_MM

JPEG_CODES = 6  # smooth colours through JPEG at quality 95
HEVC_CODES = 2  # the same through HEVC at quality 90
DAMAGED = 40  # files of five changed bytes each
CMYK_CODES = 12  # and through the four inks
ORIENTATION, EXIF, FILM_FOCAL = 0x0112, 0x8769, 0xA405


@pytest.fixture
def picture():
    rows, cols = np.mgrid[:90, :140]
    return np.dstack([cols, rows * 2, 255 - cols]).astype(np.uint8)


def saved(path, picture, **options):
    Image.fromarray(picture).save(path, **options)
    return path


@pytest.mark.parametrize("kind", ["png", "tif", "bmp", "ppm"])
def test_lossless_kinds_come_back_bit_for_bit(picture, tmp_path, kind):
    found = read_photograph(saved(tmp_path / f"page.{kind}", picture))
    np.testing.assert_array_equal(found.image, picture)
    assert (found.name, found.focal_px) == (f"page.{kind}", None)


def test_a_phone_turns_its_pictures_by_a_tag(picture, tmp_path):
    turned = np.ascontiguousarray(np.rot90(picture))  # 6: turn it a quarter clockwise to see it upright
    tags = Image.Exif()
    tags[ORIENTATION] = 6
    tags.get_ifd(EXIF)[FILM_FOCAL] = 26
    found = read_photograph(saved(tmp_path / "phone.jpg", turned, quality=95, exif=tags))
    assert found.image.shape == picture.shape
    assert np.abs(found.image.astype(int) - picture).mean() < JPEG_CODES
    assert found.focal_px == pytest.approx(26 * np.hypot(90, 140) / FILM_DIAGONAL_MM)


def test_heic_as_phones_write_it(picture):
    # `picture` turned a quarter, with EXIF tag 6 and the turn in the container, too: libheif 1.23, x265, quality 90
    pytest.importorskip("pi_heif")
    found = read_photograph(Path(__file__).with_name("turned.heic"))
    assert found.image.shape == picture.shape
    assert np.abs(found.image.astype(int) - picture).mean() < HEVC_CODES
    assert found.focal_px == pytest.approx(26 * np.hypot(90, 140) / FILM_DIAGONAL_MM)
    assert found.orientation == 6


def test_heic_without_the_extra_names_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "pi_heif", None)
    with pytest.raises(LibraryMissing, match="pi-heif") as fault:
        read_photograph(Path(__file__).with_name("turned.heic"))
    assert "planish[photos]" in fault.value.hint


def test_damaged_heic_is_refused(tmp_path, rng):
    pytest.importorskip("pi_heif")
    data = bytearray(Path(__file__).with_name("turned.heic").read_bytes())
    (tmp_path / "cut.heic").write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match=r"cut\.heic"):
        read_photograph(tmp_path / "cut.heic")
    for _ in range(DAMAGED):
        changed = bytearray(data)
        for at in rng.integers(12, len(data), 5):
            changed[at] = rng.integers(256)
        (tmp_path / "damaged.heic").write_bytes(changed)
        with suppress(BadInput):  # what can still be decoded is a picture
            assert read_photograph(tmp_path / "damaged.heic").image.ndim == 3


def test_sixteen_bits(picture, tmp_path):
    deep = picture.astype(np.uint16) * 257
    tifffile.imwrite(tmp_path / "rgb.tif", deep, photometric="rgb")
    tifffile.imwrite(tmp_path / "grey.tif", deep[..., 0], photometric="minisblack")
    np.testing.assert_array_equal(read_photograph(tmp_path / "rgb.tif").image, picture)
    np.testing.assert_array_equal(read_photograph(tmp_path / "grey.tif").image, picture[..., :1].repeat(3, axis=2))


def test_four_inks(picture, tmp_path):
    Image.fromarray(picture).convert("CMYK").save(tmp_path / "cmyk.jpg", quality=95)
    found = read_photograph(tmp_path / "cmyk.jpg").image
    assert np.abs(found.astype(int) - picture).mean() < CMYK_CODES


def test_a_colour_profile_is_obeyed(picture, tmp_path):
    lab = ImageCms.ImageCmsProfile(ImageCms.createProfile("LAB")).tobytes()
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    plain = read_photograph(saved(tmp_path / "srgb.png", picture, icc_profile=srgb)).image
    assert np.abs(plain.astype(int) - picture).max() <= 2
    # A profile for another kind of picture, or a damaged one, says nothing.
    for wrong in (lab, b"not a profile"):
        found = read_photograph(saved(tmp_path / "odd.png", picture, icc_profile=wrong)).image
        np.testing.assert_array_equal(found, picture)


def test_a_wide_profile_changes_the_colours(picture, tmp_path):
    """A profile with red and blue exchanged: whoever ignores it sees the wrong colours."""
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    red, blue = profile.index(b"rXYZ", 128), profile.index(b"bXYZ", 128)
    profile[red : red + 4], profile[blue : blue + 4] = b"bXYZ", b"rXYZ"
    found = read_photograph(saved(tmp_path / "swapped.png", picture, icc_profile=bytes(profile))).image
    assert np.abs(found.astype(int) - picture[..., ::-1]).max() <= 3


@pytest.mark.parametrize("kind", ["jpg", "png", "tif"])
def test_a_file_that_was_cut_short(picture, tmp_path, kind, rng):
    path = saved(tmp_path / f"cut.{kind}", rng.integers(0, 256, (90, 140, 3), np.uint8))
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match=f"cut.{kind}"):
        read_photograph(path)


@pytest.mark.parametrize(
    "name, content, reported",
    [
        ("empty.jpg", b"", "is empty"),
        ("text.jpg", b"no picture", "not an image of a known kind"),
        ("phone.heic", b"\0\0\0\x18ftypheic" + bytes(400), "cannot be read"),
        ("film.mp4", b"\0\0\0\x18ftypisom" + bytes(400), "AVIF image or a video"),
        ("none.jpg", None, "not there"),
        (".", None, "is a folder"),
    ],
)
def test_a_file_of_another_kind_is_named(tmp_path, name, content, reported):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(BadInput, match=reported) as refused:
        read_photograph(tmp_path / name)
    assert refused.value.hint


def test_what_is_not_a_photograph(picture, tmp_path, monkeypatch):
    float_tiff = io.BytesIO()
    tifffile.imwrite(float_tiff, picture[..., 0].astype(np.float32))
    (tmp_path / "float.tif").write_bytes(float_tiff.getvalue())
    saved(tmp_path / "thumb.png", picture[:20, :20])
    saved(tmp_path / "huge.png", picture)
    for name in ("float.tif", "thumb.png"):
        with pytest.raises(BadInput) as refused:
            read_photograph(tmp_path / name)
        assert refused.value.hint
    monkeypatch.setattr("restore.photo.photograph.MAX_PIXELS", 1000)
    with pytest.raises(BadInput, match="too many pixels"):
        read_photograph(tmp_path / "huge.png")


def test_an_array_that_is_not_a_picture(text):
    for wrong in (np.zeros((50, 50), np.uint8), np.zeros((50, 50, 3)), np.zeros((0, 5, 3), np.uint8)):
        with pytest.raises(BadInput, match="photograph 1"):
            register_photographs(text.page, [wrong])


def test_without_a_colour_image_nothing_can_be_compared(text):
    from dataclasses import replace

    (one,) = register_photographs(replace(text.page, texture=None), [Photograph(np.zeros((80, 80, 3), np.uint8))])
    assert one.registration is None
    assert "no colour image" in one.reason

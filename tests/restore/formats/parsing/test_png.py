"""PNG written by bands: decoders read the same pixels, and the file depends on the picture alone."""

from __future__ import annotations

import io
import zlib

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from restore.formats.parsing import png
from restore.formats.parsing.png import png_parts
from restore.runtime import threads
from restore.runtime.rows import Rows


def picture(height: int, width: int) -> np.ndarray:
    """Noise, so that every predictor is chosen somewhere."""
    return np.random.default_rng(height).integers(0, 256, (height, width, 3), np.uint8)


@pytest.mark.parametrize(("height", "width"), [(1, 1), (1, 7), (5, 1), (40, 33)])
@pytest.mark.parametrize("band", [1, 100, 10**6])
def test_decoders_read_the_same_pixels(height, width, band, monkeypatch):
    monkeypatch.setattr(png, "BAND_PIXELS", band)
    monkeypatch.setattr(png, "AT_ONCE", 3)
    drawn = picture(height, width)
    with Image.open(io.BytesIO(b"".join(png_parts(drawn)))) as read:
        np.testing.assert_array_equal(np.asarray(read), drawn)


def test_the_stream_ends_in_the_check_sum_of_its_rows(monkeypatch):
    """zlib refuses a stream whose check sum is wrong; Pillow would not look at it."""
    monkeypatch.setattr(png, "BAND_PIXELS", 50)
    file = b"".join(png_parts(picture(30, 20)))
    idat, place = b"", len(png.SIGNATURE)
    while place < len(file):
        length = int.from_bytes(file[place : place + 4], "big")
        if file[place + 4 : place + 8] == b"IDAT":
            idat += file[place + 8 : place + 8 + length]
        place += length + 12
    assert len(zlib.decompress(idat)) == 30 * (3 * 20 + 1)


def test_the_file_does_not_depend_on_the_number_of_threads(monkeypatch):
    monkeypatch.setattr(png, "BAND_PIXELS", 64)
    files = []
    for count in (1, 3):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        files.append(b"".join(png_parts(picture(50, 16))))
    assert files[0] == files[1]


def test_chunks_are_those_that_pillow_writes():
    texts = PngImagePlugin.PngInfo()
    texts.add_itxt("name", "värde")
    file = b"".join(png_parts(picture(4, 4), dpi=(300, 300), icc_profile=b"profile", pnginfo=texts))
    with Image.open(io.BytesIO(file)) as read:
        assert read.info["dpi"] == pytest.approx((300, 300), abs=0.02)
        assert (read.info["icc_profile"], read.info["name"]) == (b"profile", "värde")


@pytest.mark.parametrize("height", [1, 40])
def test_a_picture_that_is_drawn_by_rows_gives_the_same_file_and_is_never_whole(height, monkeypatch):
    monkeypatch.setattr(png, "BAND_PIXELS", 66)
    monkeypatch.setattr(png, "AT_ONCE", 3)
    drawn, asked = picture(height, 33), []

    def rows(some: slice) -> np.ndarray:
        asked.append(some.stop - some.start)
        return drawn[some]

    assert b"".join(png_parts(Rows(drawn.shape, np.uint8, rows))) == b"".join(png_parts(drawn))
    assert max(asked) <= 6
    assert sum(asked) == height

"""TIFF of pages, in strips."""

from __future__ import annotations

import io

import numpy as np
import pytest
import tifffile

from restore.runtime.rows import Rows
from station.images import tiff
from station.images.tiff import encode_tiff, write_tiff

DPI = 600.0
PICTURE = np.random.default_rng(7).integers(0, 256, (50, 21, 3), np.uint8)


@pytest.mark.parametrize("strip_bytes", [1, 200, 2**18])
def test_a_page_that_is_drawn_by_rows_gives_the_same_file_and_is_never_whole(strip_bytes, monkeypatch):
    monkeypatch.setattr(tiff, "STRIP_BYTES", strip_bytes)
    monkeypatch.setattr(tiff, "AT_ONCE", 2)
    asked: list[int] = []

    def rows(some: slice) -> np.ndarray:
        asked.append(some.stop - some.start)
        return PICTURE[some]

    file = io.BytesIO()
    write_tiff(Rows(PICTURE.shape, np.uint8, rows), DPI, None, file)
    assert file.getvalue() == encode_tiff(PICTURE, DPI)
    np.testing.assert_array_equal(tifffile.imread(io.BytesIO(file.getvalue())), PICTURE)
    assert sum(asked) == 50
    assert max(asked) <= max(2, 2 * strip_bytes // (3 * 21))


def test_the_strips_are_those_that_tifffile_makes():
    """What reads one reads the other: the same strips, compressed as zlib does it by default."""
    theirs = io.BytesIO()
    tifffile.imwrite(theirs, PICTURE, compression="zlib", photometric="rgb", metadata=None)
    theirs.seek(0)
    with tifffile.TiffFile(theirs) as one, tifffile.TiffFile(io.BytesIO(encode_tiff(PICTURE, DPI))) as two:
        assert one.pages[0].rowsperstrip == two.pages[0].rowsperstrip
        assert one.pages[0].databytecounts == two.pages[0].databytecounts


def test_a_page_above_the_size_of_a_tiff_is_a_bigtiff(monkeypatch):
    for limit, big in ((PICTURE.nbytes, False), (PICTURE.nbytes - 1, True)):
        monkeypatch.setattr(tiff, "MAX_BYTES", limit)
        with tifffile.TiffFile(io.BytesIO(encode_tiff(PICTURE, DPI))) as file:
            assert file.is_bigtiff == big
            np.testing.assert_array_equal(file.asarray(), PICTURE)

"""A picture that is drawn by rows is the picture, and none of it is drawn twice or too early."""

import numpy as np
import pytest

from restore.runtime import threads
from restore.runtime.rows import Rows

PICTURE = np.random.default_rng(5).integers(0, 256, (40, 7, 3), np.uint8)


@pytest.mark.parametrize("band_pixels", [1, 30, 10**6])
@pytest.mark.parametrize("some", [slice(0, 40), slice(3, 4), slice(11, 29)])
def test_rows_are_those_of_the_picture_and_drawn_once(band_pixels, some, monkeypatch):
    monkeypatch.setattr(threads, "BAND_PIXELS", band_pixels)
    drawn = np.zeros(40, int)

    def draw(rows: slice) -> np.ndarray:
        drawn[rows] += 1
        return PICTURE[rows]

    picture = Rows(PICTURE.shape, np.uint8, draw)
    assert not drawn.any()
    np.testing.assert_array_equal(picture.rows(some), PICTURE[some])
    assert (drawn[some] == 1).all()
    assert drawn.sum() == some.stop - some.start
    np.testing.assert_array_equal(picture(), PICTURE)


def test_a_picture_that_is_kept_is_not_copied():
    assert np.shares_memory(Rows.of(PICTURE).rows(slice(2, 5)), PICTURE)

"""The patterns number every pixel of the projector, in OpenCV's order."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore.errors import BadInput
from restore.structured_light import Projector
from restore.structured_light.decode import decode_axis


@pytest.mark.parametrize(("size", "count"), [((1280, 800), 44), ((1024, 768), 42), ((1920, 1080), 46), ((33, 17), 24)])
def test_there_are_two_patterns_for_each_bit_and_white_and_black(size, count):
    projector = Projector(*size)
    patterns = list(projector.patterns())
    assert len(patterns) == projector.count == count
    assert all(pattern.shape == size[::-1] for pattern in patterns)
    assert patterns[-2].min() == 255
    assert patterns[-1].max() == 0


def test_they_decode_to_each_pixels_own_column_and_row():
    projector = Projector(100, 37)
    patterns = list(projector.patterns())
    pairs = list(zip(patterns[:-2:2], patterns[1:-2:2], strict=True))
    light = np.full((37, 100), 255, np.float32)
    columns = decode_axis(pairs[: projector.bits[0]], light, projector.width)
    rows = decode_axis(pairs[projector.bits[0] :], light, projector.height)
    np.testing.assert_array_equal(columns.code, np.tile(np.arange(100), (37, 1)))
    np.testing.assert_array_equal(rows.code, np.tile(np.arange(37)[:, None], (1, 100)))
    np.testing.assert_array_equal(columns.across, 0.5)  # half-way between neighbours, everywhere
    assert np.isnan(columns.down).all()


def test_opencv_decodes_them_alike():
    projector = Projector(60, 40)
    patterns = list(projector.patterns())[:-2]
    theirs = cv2.structured_light.GrayCodePattern.create(60, 40)
    for x, y in ((0, 0), (59, 39), (31, 32), (17, 5)):
        failed, place = theirs.getProjPixel(patterns, x, y)
        assert not failed
        assert place == (x, y)


@pytest.mark.parametrize("size", [(0, 800), (1280, -1), (100_000, 800)])
def test_no_projector_has_such_a_size(size):
    with pytest.raises(BadInput, match="projector"):
        Projector(*size)

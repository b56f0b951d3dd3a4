"""Hidden pixels are inpainted where they are narrow, from the page alone."""

import numpy as np
import pytest

from restore.texture.coverage import Coverage, CoverageClass
from restore.texture.inpaint import inpaint_hidden

DPI = 127.0  # five pixels to the millimetre
ROUNDED = 2  # grey levels: the fast marching takes its weights from whole distances


def holes(*sizes):
    """A grey page of 300 × 200 pixels with square holes, and one that runs off the page."""
    seen = np.full((200, 300), CoverageClass.MEASURED, np.uint8)
    seen[:, 280:] = CoverageClass.OUTSIDE
    for number, size in enumerate(sizes):
        seen[40 : 40 + size, 20 + 80 * number : 20 + 80 * number + size] = CoverageClass.OCCLUDED
    image = np.full((200, 300, 3), 120, np.uint8)
    image[seen != CoverageClass.MEASURED] = 255
    return image, Coverage(seen)


def test_small_holes_are_inpainted_on_request_and_marked():
    image, coverage = holes(10, 40)
    filled, reported = inpaint_hidden(image, coverage, DPI, 3.0)  # fifteen pixels
    assert (reported.seen[40:50, 20:30] == CoverageClass.INPAINTED).all()
    assert (reported.seen[40:80, 100:140] == CoverageClass.OCCLUDED).all()
    assert np.abs(filled[40:50, 20:30].astype(int) - 120).max() <= ROUNDED
    assert (filled[40:80, 100:140] == 255).all()
    assert not reported.mask[45, 25]
    assert reported.fractions()["inpainted"] == pytest.approx(100 / (200 * 280))
    changed = (filled != image).any(axis=2)
    assert (reported.seen[changed] == CoverageClass.INPAINTED).all()


def test_white_off_the_page_is_not_propagated_into_a_hole_at_its_edge():
    image, coverage = holes()
    coverage.seen[100:106, 270:280] = CoverageClass.OCCLUDED
    image[100:106, 270:280] = 255
    filled, _ = inpaint_hidden(image, coverage, DPI, 5.0)
    assert np.abs(filled[100:106, 270:280].astype(int) - 120).max() <= ROUNDED


def test_nothing_is_inpainted_by_default():
    image, coverage = holes(10)
    filled, reported = inpaint_hidden(image, coverage, DPI, 0.0)
    np.testing.assert_array_equal(filled, image)
    np.testing.assert_array_equal(reported.seen, coverage.seen)

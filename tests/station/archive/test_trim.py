"""The strip of the facing page is cut off on its side, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from restore import CoverageClass
from station.archive.trim import own_box

OUTSIDE, MEASURED, FACING = CoverageClass.OUTSIDE, CoverageClass.MEASURED, CoverageClass.FACING


@pytest.mark.parametrize(
    ("strip", "box"),
    [
        ((slice(None), slice(0, 3)), (3, 0, 20, 30)),
        ((slice(None), slice(-3, None)), (0, 0, 17, 30)),
        ((slice(0, 2), slice(None)), (0, 2, 20, 30)),
        ((slice(-2, None), slice(None)), (0, 0, 20, 28)),
        ((slice(0, 10), slice(0, 3)), (0, 0, 20, 30)),  # a third of the height is not a strip
    ],
)
def test_a_strip_on_any_side(strip, box):
    seen = np.full((30, 20), MEASURED, np.uint8)
    seen[strip] = FACING
    assert own_box(seen) == box
    turned = np.pad(seen, ((0, 0), (2, 0)), constant_values=OUTSIDE)
    left, top, right, bottom = box
    assert own_box(turned) == (left + 2 if left else 0, top, right + 2, bottom)


def test_a_page_of_nothing_else_stays():
    assert own_box(np.full((4, 5), FACING, np.uint8)) == (0, 0, 5, 4)
    assert own_box(np.full((4, 5), MEASURED, np.uint8)) == (0, 0, 5, 4)

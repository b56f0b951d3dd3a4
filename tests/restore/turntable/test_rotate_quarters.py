"""A scan rotated by quarter turns is the same shot in a rotated frame."""

import numpy as np
import pytest

from restore.camera.rays import find_rays
from restore.scan import RangeScan
from restore.turntable.rotate import rotate_quarters

ROUNDING = 1e-9


@pytest.fixture
def scan() -> RangeScan:
    """A tilted plane, seen by 6 × 9 samples; every texture pixel has its own colour, two of them to a sample."""
    rows, cols = np.indices((6, 9)).astype(float)
    depth = 900.0 + 3.0 * rows + 5.0 * cols
    points = np.stack([(cols - 4) * depth / 500, (2.5 - rows) * depth / 500, -depth], axis=-1)
    texture = np.random.default_rng(1).integers(0, 256, (12, 18, 3), np.uint8)
    return RangeScan(points, texture, np.stack([2 * cols + 1, 2 * rows], axis=-1))


@pytest.mark.parametrize("quarters", [-2, -1, 1, 2, 3])
def test_samples_keep_their_colour_and_rotate_rigidly(scan: RangeScan, quarters: int) -> None:
    rolled = rotate_quarters(scan, quarters)
    angle = np.pi / 2 * quarters
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    before = {tuple(np.round(turn @ p, 6) + 0.0): colour_at(scan, i) for i, p in samples(scan)}
    after = {tuple(np.round(p, 6) + 0.0): colour_at(rolled, i) for i, p in samples(rolled)}
    assert before == after


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_a_rotated_scan_has_the_rays_of_one_camera(scan: RangeScan, quarters: int) -> None:
    rolled = rotate_quarters(scan, quarters)
    assert find_rays(rolled) is not None
    assert rolled.points[0, 0, 0] < rolled.points[0, -1, 0]
    assert rolled.points[0, 0, 1] > rolled.points[-1, 0, 1]


def test_four_quarter_turns_are_the_identity(scan: RangeScan) -> None:
    assert rotate_quarters(scan, 4) is scan
    again = rotate_quarters(rotate_quarters(scan, 3), 1)
    np.testing.assert_allclose(again.points, scan.points, atol=ROUNDING)
    np.testing.assert_array_equal(again.texture, scan.texture)
    np.testing.assert_array_equal(again.texture_xy, scan.texture_xy)


def samples(scan: RangeScan):
    return [
        ((row, col), scan.points[row, col])
        for row in range(scan.points.shape[0])
        for col in range(scan.points.shape[1])
    ]


def colour_at(scan: RangeScan, index: tuple[int, int]) -> tuple[int, ...]:
    x, y = scan.texture_xy[index].astype(int)
    return tuple(int(value) for value in scan.texture[y, x])

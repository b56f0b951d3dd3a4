"""The size of a grid: stated by remarks, shown by the points.

Asked for where two sizes are as likely.
"""

import numpy as np
import pytest
from PIL import Image

from oracles.clouds import write_ply
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.grid_size import likely_size, parse_grid, stated_size
from restore.scan import RangeScan
from tests.restore.formats.conftest import make_shot


@pytest.mark.parametrize(
    "lines",
    [
        [b"width 32", b"height 24"],
        [b"num_cols 32", b"num_rows 24"],
        [b"Width: 32", b"Height: 24"],
        [b"organised 32 x 24"],
        [b"made in 2024", b"cols=32 rows=24"],
    ],
)
def test_remarks_state_the_size(lines):
    assert stated_size(lines, 768) == (32, 24)


def test_remarks_of_another_count_do_not():
    assert stated_size([b"width 32", b"height 25"], 768) is None


def test_neighbours_show_the_size_of_a_grid_with_gaps(tmp_path, sheet, same_as):
    write_ply(tmp_path / "a.ply", sheet)
    same_as(load_scan(tmp_path / "a.ply"), sheet)


def square(rows, cols):
    """A flat grid with steps of 1 mm from column to column, and of 9 mm from row to row."""
    col, row = np.meshgrid(np.arange(cols), np.arange(rows))
    return np.dstack([col - cols / 2, -9.0 * (row - rows / 2), np.full((rows, cols), -700.0)])


def test_two_sizes_that_are_as_likely_are_asked_for(tmp_path):
    points = square(31, 30)
    scan = RangeScan(points, np.zeros((31, 30, 3), np.uint8), np.stack(np.meshgrid(np.arange(30), np.arange(31)), -1))
    write_ply(tmp_path / "a.ply", scan, axes=np.ones(3))
    with pytest.raises(BadInput, match="a grid of") as raised:
        load_scan(tmp_path / "a.ply")
    assert "--grid 30x31" in raised.value.hint
    assert load_scan(tmp_path / "a.ply", grid="30x31").points.shape == (31, 30, 3)
    Image.new("RGB", (300, 310)).save(tmp_path / "a.png")
    assert load_scan(tmp_path / "a.ply").points.shape == (31, 30, 3)


def test_points_in_any_order_are_not_a_grid():
    points = make_shot(24, 32, whole=True, missing=0.0).points.reshape(-1, 3)
    assert likely_size("a", np.random.default_rng(0).permutation(points)) is None


def test_a_size_that_does_not_fit_names_those_that_do(tmp_path, sheet):
    write_ply(tmp_path / "a.ply", sheet)
    with pytest.raises(BadInput, match="768 points, a grid of 30 × 30 has 900") as raised:
        load_scan(tmp_path / "a.ply", grid="30x30")
    assert "32x24" in raised.value.hint


@pytest.mark.parametrize("text", ["32", "0x5", "axb", "-3x4", "99999999x2", "2x3 "])
def test_a_size_is_two_whole_numbers(text):
    with pytest.raises(BadInput, match="not the size of a grid"):
        parse_grid(text)

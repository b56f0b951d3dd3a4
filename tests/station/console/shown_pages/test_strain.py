"""The strain of a page: tiles drawn from the mesh, whatever the size of the page."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from restore.drawing import rasterise
from station.console.shown_pages.strain import OPACITY, StrainPyramid, end_of_scale
from station.console.shown_pages.tiles import MAX_WHOLE_PIXELS, TILE

CELLS = 30


def square(size: tuple[int, int]) -> StrainPyramid:
    """A page whose strain grows from left to right, from −1 % to 1 %."""
    rows, cols = np.mgrid[: CELLS + 1, : CELLS + 1]
    uv = np.stack([cols.ravel(), rows.ravel()], 1) / CELLS
    corner = (rows[:-1, :-1] * (CELLS + 1) + cols[:-1, :-1]).ravel()
    faces = np.concatenate([corner[:, None] + [0, 1, CELLS + 2], corner[:, None] + [0, CELLS + 2, CELLS + 1]])
    return StrainPyramid(size, uv, faces, (uv[:, 0] - 0.5) * 0.02)


def test_tiles_put_together_are_the_whole():
    pyramid = square((700, 300))
    whole = np.zeros((300, 700, 4), np.uint8)
    last = len(pyramid.sizes) - 1
    for row in range(2):
        for column in range(3):
            tile = pyramid.tile(last, column, row)
            top, left = max(row * TILE - 1, 0), max(column * TILE - 1, 0)
            whole[top : top + tile.shape[0], left : left + tile.shape[1]] = tile
    assert np.array_equal(whole, pyramid.whole())
    assert (whole[..., 3] == OPACITY).all()
    assert whole[0, 0, 2] > whole[0, 0, 0]  # compressed: blue
    assert whole[0, -1, 0] > whole[0, -1, 2]  # stretched: red


def test_every_level_shows_the_same_place():
    pyramid = square((1024, 1024))
    for level in (5, 8, 10):
        width, height = pyramid.sizes[level]
        picture = pyramid.region(level, (0, 0, width, height))
        expected = rasterise(
            pyramid._uv * [width, -height] + [-0.5, height - 0.5], pyramid._faces, pyramid._strain, height, width
        )
        reddest = np.argmax(picture[height // 2, :, 0].astype(int) - picture[height // 2, :, 2])
        assert expected[height // 2, reddest, 0] >= 0.9 * end_of_scale(pyramid._strain[:, 0]) - 0.02 / width


@pytest.mark.parametrize("size", [(10_900, 11_000), (60_000, 2_000)])
def test_a_large_page_takes_no_more_memory_than_a_tile(size):
    """120 megapixels took 9.1 GB as a whole; here a tile and the smaller picture of `full` take their own pixels."""
    pyramid = square(size)
    tracemalloc.start()
    try:
        tile = pyramid.tile(len(pyramid.sizes) - 1, 20, 3)
        assert tile.shape == (TILE + 2, TILE + 2, 4)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    whole = pyramid.whole()
    assert MAX_WHOLE_PIXELS / 4 < whole.shape[0] * whole.shape[1] <= MAX_WHOLE_PIXELS

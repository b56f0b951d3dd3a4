"""Several pictures packed into one: each vertex keeps the colour that it had in its own picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from restore.errors import BadInput
from restore.formats.cleaning.packing import MAX_PICTURES, pack

FILE = Path("a.obj")


def colour_at(picture, uv):
    """The pixel of a picture that holds texture coordinates, v up."""
    height, width = picture.shape[:2]
    return picture[int((1.0 - uv[1]) * height), int(uv[0] * width)]


def test_every_vertex_keeps_its_colour():
    rng = np.random.default_rng(0)
    pictures = [rng.integers(0, 256, (*size, 3), np.uint8) for size in ((20, 30), (7, 11), (40, 5))]
    uv, picture_of = rng.uniform(0.05, 0.95, (9, 2)), np.repeat([0, 1, 2], 3)
    sheet, moved = pack(FILE, pictures, uv, picture_of, np.arange(9).reshape(3, 3))
    for old, new, picture in zip(uv, moved, picture_of, strict=True):
        np.testing.assert_array_equal(colour_at(sheet, new), colour_at(pictures[picture], old))


def test_more_pictures_than_a_scan_has_are_refused():
    pictures = [np.zeros((2, 2, 3), np.uint8)] * (MAX_PICTURES + 1)
    with pytest.raises(BadInput, match="images with too many pixels"):
        pack(FILE, pictures, np.zeros((3, 2)), np.zeros(3, np.int64), np.array([[0, 1, 2]]))

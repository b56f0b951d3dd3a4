"""Millimetres of a result become the pixels that it shows there."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from restore import BadInput
from station.images.tiff import encode_map
from station.run.result_map import pixels_of

DPI = 25.4  # one pixel to the millimetre


@pytest.fixture
def path(tmp_path):
    """The map of a page of 30 × 20 mm within 34 × 24: x of the source is 10 + 2 x, y is 5 + y."""
    cols, rows = np.meshgrid(np.arange(34.0), np.arange(24.0))
    source = np.stack([10 + 2 * cols, 5 + rows], axis=2).astype(np.float32)
    source[:2], source[-2:], source[:, :2], source[:, -2:] = (np.nan,) * 4
    page = SimpleNamespace(page_map=source, page_source=None, dpi=DPI)
    (tmp_path / "book-map.tif").write_bytes(encode_map(page))
    return tmp_path / "book-map.tif"


def test_places_on_the_paper(path):
    assert pixels_of([[10.5, 7.5], [2.5, 2.5]], path) == [[30.0, 12.0], [14.0, 7.0]]
    assert pixels_of([[10.5, 0.6]], path) == [[30.0, 7.0]]  # to the edge of the paper, 2 mm off


def test_what_is_not_on_the_paper_or_has_no_map_is_refused(path, tmp_path):
    for point in ([10.5, -3.0], [1e6, 5.0], [-1e6, -1e6]):
        with pytest.raises(BadInput, match="not on the page"):
            pixels_of([point], path)
    with pytest.raises(BadInput, match="does not exist"):
        pixels_of([[1, 1]], tmp_path / "gone-map.tif")
    (tmp_path / "text.tif").write_text("no")
    with pytest.raises(BadInput, match="is not a map"):
        pixels_of([[1, 1]], tmp_path / "text.tif")

"""A preview: the page's proportions and colours, in an element that loads nothing."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
from PIL import Image

from station.batch.preview import PICTURE_PX, preview

LOSS = 3  # levels of 255 that JPEG loses on an even area


def test_a_preview_is_the_page_small_and_within_the_element() -> None:
    page = np.full((1200, 900, 3), (200, 30, 60), np.uint8)
    found = re.fullmatch(
        r"<img alt='' width='(\d+)' height='(\d+)' src='data:image/jpeg;base64,([\w+/=]+)'>", preview(page)
    )
    assert found is not None
    small = np.asarray(Image.open(io.BytesIO(base64.b64decode(found[3]))))
    assert small.shape == (PICTURE_PX, PICTURE_PX * 3 // 4, 3) == (int(found[2]), int(found[1]), 3)
    assert np.abs(small.astype(int) - page[0, 0]).max() <= LOSS

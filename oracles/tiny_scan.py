"""A scan of twenty points: to be stored, not to be restored."""

from __future__ import annotations

import numpy as np

from restore import RangeScan


def tiny_scan(seed: int = 1) -> RangeScan:
    """A scan of four by five points with a texture of eight by eight pixels, another one for each seed."""
    random = np.random.default_rng(seed)
    texture = random.integers(0, 256, (8, 8, 3), np.uint8)
    return RangeScan(random.normal(size=(4, 5, 3)), texture, random.uniform(0, 7, (4, 5, 2)), {"device": "none"})

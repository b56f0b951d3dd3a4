"""A page in the middle of a small picture, as tests of what stands out of a plane take it."""

import numpy as np
import pytest

SHAPE = (120, 160)


@pytest.fixture
def page():
    """60 × 80 samples of the picture's 120 × 160."""
    area = np.zeros(SHAPE, bool)
    area[30:90, 40:120] = True
    return area


@pytest.fixture
def columns():
    """The column of every sample."""
    return np.broadcast_to(np.arange(SHAPE[1], dtype=float), SHAPE)

"""Small opened books, shot once for all tests."""

from __future__ import annotations

from functools import cache

import pytest

from drivers.simulated import Facing, Figure, Opening, shoot

PAGE_MM, SPINE_MM = (200.0, 130.0), 108.0


@cache
def shot(plate: bool):
    """A scan in the fast mode, and its truth: the gutter 8 mm right of the middle."""
    artwork = Figure() if plate else Facing(left_mm=SPINE_MM, seed=5)
    return shoot(Opening(left_deg=40.0, right_deg=55.0, offset_mm=8), artwork, page_mm=PAGE_MM, mode="fast")


@pytest.fixture
def opened():
    """A book of text."""
    return shot(False)


@pytest.fixture
def plate():
    """The same book with one picture across both pages."""
    return shot(True)

"""A right gutter is as wide in each row; one between leaves that do not meet so is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Spread
from oracles.printed_points import rounded, sampled
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.reconstruct import MAX_OFF_MM
from restore.photogrammetry.surfaces.folded import GUTTER_MM, FoldedSurface, fold
from restore.photogrammetry.surfaces.gutter import widths_across

SPREAD = Spread(slope_deg=58.0, reach_mm=30.0)
SLANT = 0.02  # radians


@pytest.fixture(scope="module")
def spread() -> FoldedSurface:
    points, _ = sampled(SPREAD)
    smooth, feet = rounded(SPREAD, points)
    surface = fold(points, feet, smooth)
    assert isinstance(surface, FoldedSurface)
    return surface


def test_a_gutter_is_as_wide_in_each_row(spread):
    assert np.ptp(widths_across(spread)) < MAX_OFF_MM


def test_a_leaf_that_slants_along_the_spine_makes_it_uneven(spread):
    cosine, sine = np.cos(SLANT), np.sin(SLANT)
    turned = Similarity(1.0, np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]]), np.zeros(3))
    first, second = spread.pieces
    widths = widths_across(replace(spread, pieces=(first, second.moved(turned))))
    # A leaf raised by h meets the other farther on, which changes no length; its row ends at its slope, h · sin before.
    end = np.radians(SPREAD.slope_deg) * np.exp(-GUTTER_MM / SPREAD.reach_mm)
    rows = np.ptp(spread.places[:, 1])
    # The rows end on places of a surface that rounds the spine: a third of a slope off.
    assert np.ptp(widths) == pytest.approx(SLANT * rows * np.sin(end), rel=0.3)

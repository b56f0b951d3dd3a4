"""A word is whole on a leaf, in the overlap of both, or cut; ink over a spine is seen."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Engraving, Facing, Text
from oracles.leaf_sides import boxes_cut, inner_edge, is_printed_over
from restore import Settings, restore_leaves
from tests.restore.layout.conftest import SPINE_MM, shot

EDGES = {
    "left": np.array([[101.0, 0.0], [103.0, 100.0]]),  # the spine leans
    "right": np.array([[99.0, 0.0], [101.0, 100.0]]),
}


@pytest.mark.parametrize(
    ("box", "cut"),
    [
        ((80.0, 10.0, 98.0, 14.0), 0),
        ((80.0, 10.0, 101.1, 14.0), 0),
        ((80.0, 10.0, 101.3, 14.0), 1),
        ((80.0, 90.0, 102.6, 94.0), 0),
        ((101.5, 90.0, 120.0, 94.0), 0),
        ((100.5, 90.0, 120.0, 94.0), 1),
        ((99.5, 10.0, 100.9, 14.0), 0),
    ],
)
def test_a_box_is_cut_that_is_whole_on_no_leaf(box, cut):
    assert boxes_cut([box], EDGES) == cut


def test_a_leaf_ends_where_its_overlap_ends():
    scan, truth = shot(False)
    pages = dict(restore_leaves(scan, Settings(points=300, dpi=60)).parts())
    ends = {side: inner_edge(page, scan, truth, side) for side, page in pages.items()}
    for side, overlap in (("left", 1.0), ("right", -1.0)):
        assert np.median(ends[side][:, 0]) == pytest.approx(SPINE_MM + overlap, abs=0.5)  # a pixel of 60 dpi
        assert np.ptp(ends[side][:, 1]) > 120.0


def test_print_over_the_spine_is_seen():
    page_mm = (160.0, 110.0)
    assert is_printed_over(Engraving(seed=1).print_on(page_mm), 80.0)
    assert is_printed_over(Text(sizes_pt=(12.0,), title_pt=12.0).print_on(page_mm), 80.0)
    assert not is_printed_over(Facing(left_mm=80.0).print_on(page_mm), 80.0)

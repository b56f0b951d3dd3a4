"""A leaf ends at the spine that it is given, with a strip of the facing page beyond."""

from __future__ import annotations

import numpy as np
import pytest

from restore import Settings
from restore.layout.find import inspect
from restore.layout.split import split_at_crease
from restore.mesh.measures import edge_strain, signed_areas
from restore.pipeline import Stopwatch
from restore.prepared.leaf_sheet import A_LEAF
from restore.prepared.prepare import prepare
from tests.restore.layout.conftest import PAGE_MM, SPINE_MM, shot

COARSE = Settings(points=300)
ERROR_MM = 0.3  # a third of a sample
STRAIN = 0.01  # rms of the edges: a sample's noise on edges of the fast mode


@pytest.mark.parametrize("overlap_mm", [1.0, 4.0])
def test_a_leaf_has_the_width_of_its_paper_and_of_the_strip(overlap_mm):
    parts = split_at_crease(inspect(shot(False)[0], COARSE), overlap_mm)
    for side, width in (("left", SPINE_MM), ("right", PAGE_MM[0] - SPINE_MM)):
        leaf = prepare(parts[side])
        assert leaf.with_noise() == A_LEAF
        page = leaf.unroll(COARSE, Stopwatch(None))
        fine = page.fine
        assert np.ptp(fine.flat[:, 0]) == pytest.approx(width + overlap_mm, abs=ERROR_MM)
        assert len(page.nodes) == len(fine.flat) == len(fine.vertices) == len(fine.texcoords)
        assert (signed_areas(fine.flat, fine.faces) > 0).all()
        assert np.sqrt(np.mean(edge_strain(fine.flat, fine.edges, fine.lengths) ** 2)) < STRAIN

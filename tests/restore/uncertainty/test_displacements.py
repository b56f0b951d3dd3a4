"""Probes of the noise are drawn from the seed that they are given."""

from contextlib import nullcontext

import numpy as np

from drivers.simulated import Curl, shoot
from restore import Settings
from restore.prepared.prepare import prepare
from restore.range_image.facets.sheet import PageOnGrid
from restore.uncertainty.displacements import PROBES, displacements


def test_the_same_seed_gives_the_same_displacements():
    scan, _ = shoot(Curl(radius_mm=90.0), seed=4, mode="fast", page_mm=(100.0, 70.0))
    prepared = prepare(scan)
    unrolled = prepared.unroll(Settings(points=300), lambda _: nullcontext())
    page = PageOnGrid(unrolled.fine.flat, unrolled.fine.faces, unrolled.nodes)
    places = unrolled.nodes[::50]
    one, same, other = (displacements(prepared.sheet, page, places, np.random.default_rng(k)) for k in (1, 1, 2))
    assert one.noise.shape == (PROBES, len(places), 2)
    np.testing.assert_array_equal(one.noise, same.noise)
    np.testing.assert_array_equal(one.lattices, other.lattices)  # what no noise has a part in
    assert np.abs(one.noise - other.noise).max() > 0.0

"""Probes of the noise are drawn from the seed that they are given."""

from contextlib import nullcontext

import numpy as np
import pytest

from drivers.simulated import Curl, Spread, shoot
from restore import Settings
from restore.prepared.prepare import prepare
from restore.range_image.facets.sheet import PageOnGrid
from restore.uncertainty.displacements import PROBES, displacements


def unrolled_page(sheet, **fields):
    scan, _ = shoot(sheet, mode="fast", **fields)
    prepared = prepare(scan)
    unrolled = prepared.unroll(Settings(points=300), lambda _: nullcontext())
    return prepared.sheet, PageOnGrid(unrolled.fine.flat, unrolled.fine.faces, unrolled.nodes)


def test_the_same_seed_gives_the_same_displacements():
    sheet, page = unrolled_page(Curl(radius_mm=90.0), seed=4, page_mm=(100.0, 70.0))
    places = page.nodes[::50]
    one, same, other = (displacements(sheet, page, places, np.random.default_rng(k)) for k in (1, 1, 2))
    assert one.noise.shape == (PROBES, len(places), 2)
    np.testing.assert_array_equal(one.noise, same.noise)
    np.testing.assert_array_equal(one.lattices, other.lattices)  # what no noise has a part in
    assert np.abs(one.noise - other.noise).max() > 0.0


@pytest.mark.slow
def test_a_gutter_may_be_wrong_by_a_step_and_a_curl_has_no_crease():
    at_crease = []
    for sheet in (Spread(slope_deg=60.0, reach_mm=16.0), Curl(radius_mm=90.0)):
        prepared, page = unrolled_page(sheet, seed=4, page_mm=(140.0, 90.0))
        found = displacements(prepared, page, page.nodes[::50], np.random.default_rng(1)).creases
        x = page.flat[::50, 0]
        left, right = x < np.quantile(x, 0.3), x > np.quantile(x, 0.7)
        at_crease.append([found[left, 0].mean() - found[right, 0].mean(), np.ptp(found[left, 0])])
    (step, within), (none, _) = np.abs(at_crease)
    assert step > 0.02 > 10.0 * none  # mm
    assert within < step  # each leaf moves as a whole

"""The uncertainty of a flat page: from known displacements exactly, and from one scan as it is stated in its report."""

import numpy as np
import pytest

from drivers.simulated import Curl, Flat, shoot
from restore import Settings, SurfaceMesh, restore
from restore.prepared.prepared import NO_NOISE
from restore.uncertainty.displacements import Displacements, without_rigid_part
from restore.uncertainty.estimate import _distance_of_95, combined
from restore.uncertainty.noise import Noise

SMALL = {"mode": "fast", "page_mm": (120.0, 90.0)}
FLAT_MM = 0.002  # nothing but noise moves the places of a flat page: 0.0008 on one of 200 × 150 mm


def test_displacements_are_combined_by_their_squares():
    known = np.ones((3, 4), bool)
    probes = np.where(np.arange(16)[:, None, None] % 2, 1.0, -1.0) * np.ones((16, 12, 2))
    fields = np.full((2, 12, 2), 3.0), np.full((12, 2), 4.0), np.full((12, 2), 12.0)
    stated = combined(Displacements(probes, *fields, Noise(np.ones((1, 1)), 0.0, 0.0)), known)
    np.testing.assert_allclose(stated.noise, np.sqrt(16 / 15))
    np.testing.assert_allclose(stated.method, 13.0)
    np.testing.assert_allclose(stated.total, np.sqrt(169.0 + 16 / 15))
    np.testing.assert_allclose(stated.sides, 0.0, atol=1e-12)  # all places move together: no side is longer


def test_a_side_is_longer_by_the_stretch_of_the_field():
    known = np.ones((3, 5), bool)
    rows, cols = np.nonzero(known)
    stretch = np.stack([0.01 * 5.0 * cols, np.zeros(len(cols))], axis=1)  # one per cent of 5 mm from place to place
    still = np.zeros((16, len(rows), 2)), np.zeros((2, len(rows), 2))
    stated = combined(Displacements(*still, stretch, np.zeros_like(stretch), Noise(np.ones((1, 1)), 0.0, 0.0)), known)
    np.testing.assert_allclose(stated.sides, [0.01 * 20.0, 0.0], atol=1e-12)


def test_a_page_that_moves_as_a_whole_is_not_uncertain():
    places = np.random.default_rng(1).uniform(0.0, 100.0, (40, 2))
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    np.testing.assert_allclose(without_rigid_part(places @ turn + [3.0, -8.0], places), 0.0, atol=1e-12)


def test_95_per_cent_of_normal_errors_are_within_2_45_deviations():
    assert _distance_of_95(np.full(100, 2.0)) == pytest.approx(2.0 * np.sqrt(-2.0 * np.log(0.05)), rel=1e-6)


@pytest.fixture(scope="module")
def curled():
    scan, _ = shoot(Curl(radius_mm=90.0), seed=4, **SMALL)
    return scan, restore(scan, Settings(points=300, dpi=60, uncertainty=True))


def test_a_page_states_the_uncertainty_of_every_pixel(curled):
    _, page = curled
    stated = page.report["uncertainty_mm"]
    assert page.uncertainty.dtype == np.float32
    np.testing.assert_array_equal(np.isfinite(page.uncertainty), page.mask)
    assert stated["total"] == pytest.approx(np.hypot(stated["noise"], stated["method"]), rel=1e-6)
    assert np.sqrt(np.nanmean(page.uncertainty**2)) == pytest.approx(stated["total"], rel=0.1)
    assert page.report["size_mm_ci95"][0] > 1.96 * 0.005 * page.report["page_mm"][0]


def test_without_it_the_page_is_the_same(curled):
    scan, page = curled
    plain = restore(scan, Settings(points=300, dpi=60))
    assert plain.uncertainty is None
    assert "uncertainty_mm" not in plain.report
    np.testing.assert_array_equal(plain.image, page.image)
    np.testing.assert_array_equal(plain.fine.flat, page.fine.flat)


def test_a_flat_page_has_no_floor_added():
    scan, _ = shoot(Flat(), seed=5, **SMALL)
    page = restore(scan, Settings(points=300, dpi=60, uncertainty=True))
    assert 0.0 < page.report["uncertainty_mm"]["total"] < FLAT_MM


def test_a_mesh_has_none_and_says_why():
    corners = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
    page = restore(SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30, uncertainty=True))
    assert page.uncertainty is None
    assert page.report["uncertainty_mm"] == {"reason": NO_NOISE}

"""The relief of a sheet of many creases against exact sheets, from points that end before the creases."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.simulated import Miura, MultiFold
from oracles.printed_points import HALF, PAGE_MM, rounded, sampled
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.surfaces import relief as module
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.relief import Relief, raise_relief
from restore.photogrammetry.surfaces.surface import grid_places

SHEETS = {"miura": Miura(), "multifold": MultiFold()}
MOVE = Similarity(2.0, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([1.0, 2.0, 3.0]))
NODES = 8000  # where no height is compared with the sheet's
PRINT_MM = 20.0  # from the edge: where points are


def raised(sheet, spacing: float = 1.5) -> tuple[Relief, Cloud]:
    points, _ = sampled(sheet, spacing)
    smooth, feet = rounded(sheet, points)
    relief = raise_relief(points, feet, smooth)
    return relief, Cloud.of(points, relief.feet(points, feet))


@pytest.fixture(scope="module", params=SHEETS)
def known(request) -> tuple[object, Relief, Cloud, Relief]:
    """A sheet, its first relief, its points, and the relief refined."""
    relief, cloud = raised(SHEETS[request.param])
    return SHEETS[request.param], relief, cloud, relief.through(cloud)


@pytest.fixture(scope="module", params=["multifold", pytest.param("miura", marks=pytest.mark.slow)])
def coarse(request) -> tuple[Cloud, Relief]:
    """Points of a sheet and their relief, of a fifth of the nodes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "NODES", NODES)
        relief, cloud = raised(SHEETS[request.param], spacing=2.5)
        return cloud, relief.through(cloud)


def off(surface, sheet, cloud: Cloud) -> np.ndarray:
    """(n,) mm from exact points of the print, beside creases as well, to a surface."""
    places = grid_places(-HALF + PRINT_MM, HALF - PRINT_MM, 2.0)
    points = sheet.warp(places, PAGE_MM)
    start = cloud.feet[np.argmin(np.linalg.norm(points[:, None] - cloud.points[None, ::7], axis=2), axis=1) * 7]
    return np.linalg.norm(points - surface.points(surface.feet(points, start)), axis=1)


@pytest.mark.slow
def test_a_relief_follows_facets_to_their_creases(known):
    sheet, first, cloud, relief = known
    after = off(relief, sheet, cloud)
    assert np.median(after) < 0.015  # half the noise of a point: a facet has many
    assert np.quantile(after, 0.99) < 0.3
    assert np.sqrt((after**2).mean()) < 0.3 * np.sqrt((off(first.base, sheet, cloud) ** 2).mean())


@pytest.mark.slow
def test_a_rough_edge_does_not_bend_what_exact_points_show(known):
    sheet, _, cloud, relief = known
    low, high = cloud.feet.min(axis=0) - 8, cloud.feet.max(axis=0) + 8
    feet = grid_places(low, high, 2.0)
    feet = feet[(feet < low + 2.1).any(axis=1) | (feet > high - 2.1).any(axis=1)]
    rim = relief.points(feet) + [0.0, 0.0, 0.8]
    both = relief.through(cloud.joined(Cloud.of(rim, feet, 0.3, of_facets=False)))
    assert np.median(off(both, sheet, cloud)) < 0.02


def test_a_patch_within_a_facet_is_kept_and_one_over_a_crease_is_not(coarse):
    cloud, relief = coarse
    kept = relief.uncreased(cloud.feet, 1.0)
    assert kept.mean() > 0.95
    middle = (cloud.feet.min(axis=0) + cloud.feet.max(axis=0)) / 2
    dense = grid_places(middle - 50, middle + 50, 1.0)
    assert 0.02 < 1 - relief.uncreased(dense, 1.0).mean() < 0.6


def test_frames_are_those_of_the_facets(coarse):
    cloud, relief = coarse
    points, tangents, normals, curvatures = relief.frames(cloud.feet[::20])
    np.testing.assert_allclose(np.cross(tangents[:, 0], tangents[:, 1]), normals, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=2), 1.0)
    np.testing.assert_allclose(points, relief.points(cloud.feet[::20]))
    assert (curvatures == 0).all()


def test_a_relief_moves_with_its_frame(coarse):
    cloud, relief = coarse
    moved, feet = relief.moved(MOVE), cloud.feet[::50]
    np.testing.assert_allclose(moved.points(feet), MOVE.points(relief.points(feet)), atol=1e-6)
    np.testing.assert_allclose(moved.normals(feet), relief.normals(feet) @ MOVE.rotation.T, atol=1e-6)
    np.testing.assert_allclose(moved.feet(MOVE.points(cloud.points[::50]), feet), feet, atol=0.05)


def test_clouds_keep_their_noise_when_joined():
    one = Cloud.of(np.zeros((3, 3)), np.zeros((3, 2)), 0.04)
    other = Cloud.of(np.ones((2, 3)), np.ones((2, 2)), np.array([0.1, 0.2]), of_facets=False)
    both = one.joined(other)
    np.testing.assert_allclose(both.noise, [0.04, 0.04, 0.04, 0.1, 0.2])
    assert both.of_facets.tolist() == [True, True, True, False, False]
    assert both.points[:, 0].tolist() == both.feet[:, 0].tolist() == [0, 0, 0, 1, 1]

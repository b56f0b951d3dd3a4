"""The shape over the flat page: points and normals of planes, roofs and cylinders, on grids and on meshes."""

from contextlib import nullcontext

import numpy as np
import pytest

from oracles.warped import make_warped
from restore.flattening.methods import flatten_with_lengths
from restore.prepared.facet_sheet import FacetSheet, unroll
from restore.prepared.plain_mesh import PlainMesh
from restore.prepared.prepare import prepare
from restore.range_image.facets.normals import facet_normals
from restore.settings import Settings
from restore.shading.relief import relief_of

DPI = 50.0
TILT = np.array([0.3, -0.2, 1.0])
SINGLE = 1e-5  # unit normals in single precision
ON_SURFACE_MM = 0.01  # page pixels between vertices of the fine mesh, 2 mm apart, on a plane
RADIUS_MM = 60.0
CHORD_MM = 0.02  # sagitta of a 60 mm cylinder over the 1.9 mm between vertices is 0.0075 mm
FACET_DEG = 0.5  # half a sample, 0.23 mm on 60 mm, and the pixel that a normal is taken from


@pytest.fixture(scope="module")
def on_page(camera):
    """The middle of the grid holds the page."""

    def shot(inverse_depth):
        page = np.full(camera.shape, np.nan)
        page[20:140, 30:170] = inverse_depth[20:140, 30:170]
        return prepare(camera.shot(page)).sheet

    return shot


def lifted(sheet):
    fine = unroll(sheet, Settings(points=300), lambda _: nullcontext()).fine
    return relief_of(fine, FacetSheet(sheet).normals_on, DPI)


def in_scanner(relief):
    """Points and normals of the page's pixels, (n, 3) mm and (n, 3), in the scanner's frame."""
    inside = relief.inside
    return relief.points[inside] @ relief.axes + relief.origin, relief.normals[inside] @ relief.axes


def test_a_plane_has_one_normal_and_its_points_lie_on_it(camera, on_page):
    sheet = on_page(camera.plane(tuple(TILT)))
    normal = TILT / np.linalg.norm(TILT)
    facets = facet_normals(sheet)
    np.testing.assert_allclose(facets[sheet.inside], np.broadcast_to(normal, (sheet.inside.sum(), 3)), atol=SINGLE)
    relief = lifted(sheet)
    points, normals = in_scanner(relief)
    np.testing.assert_allclose(normals, np.broadcast_to(normal, normals.shape), atol=SINGLE)
    assert np.abs(points @ normal + 921.5 * normal[2]).max() < ON_SURFACE_MM
    assert np.abs(relief.points[relief.inside][:, 2]).max() < ON_SURFACE_MM  # its frame's z is the mean normal


def test_on_a_roof_each_side_keeps_its_own_normal_up_to_the_ridge(camera, on_page):
    left, right = camera.walls(60.0, 0.0, 100.0)
    sheet = on_page(np.minimum(left, right))
    relief = lifted(sheet)
    _, normals = in_scanner(relief)
    half = np.radians(30.0)
    truth = np.array([[-np.sin(half), 0, np.cos(half)], [np.sin(half), 0, np.cos(half)]])
    off = np.degrees(np.arccos(np.clip((normals @ truth.T).max(axis=1), -1, 1)))
    # A facet that has the ridge among its samples may lean a little; those are a fiftieth of the page.
    assert np.percentile(off, 95) < FACET_DEG
    sides = (normals @ truth.T).argmax(axis=1)
    assert 0.3 < sides.mean() < 0.7


def test_a_cylinder_has_the_normals_of_its_radii(camera, on_page):
    points, normals = in_scanner(lifted(on_page(camera.cylinder(RADIUS_MM))))
    radii = (points - [0, 0, -921.5 - RADIUS_MM]) * [1, 0, 1]
    length = np.linalg.norm(radii, axis=1)
    assert np.abs(length - RADIUS_MM).max() < CHORD_MM
    off = np.degrees(np.arccos(np.clip((normals * radii).sum(axis=1) / length, -1, 1)))
    # At the border a facet has samples on one side only.
    assert np.percentile(off, 95) < 2 * FACET_DEG


def test_a_mesh_without_a_grid_has_unit_normals_on_its_printed_side():
    warped = make_warped("oblique wave", count=600)
    fine = flatten_with_lengths(warped.mesh, warped.lengths, "conformal")
    relief = relief_of(fine, PlainMesh(warped.mesh).normals_on, DPI)
    _, normals = in_scanner(relief)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=SINGLE)
    assert (normals[:, 2] > 0).all()  # towards the scanner: the wave is 50° steep at most
    assert not np.isfinite(relief.normals[~relief.inside]).any()

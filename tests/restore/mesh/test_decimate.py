"""Decimation preserves the shape and the border, and leaves the requested number of points."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from scipy.spatial import cKDTree

from restore.errors import NotEnoughSurface
from restore.mesh.decimate import MAX_HOLE_EDGES, decimate, patch_and_smooth
from restore.mesh.measures import signed_areas, surface_area
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice, triangulate
from restore.range_image.facets.sheet import depth_distance

POINTS = 0.05  # relative: what a collapse takes with it differs along the border
MAX_BORDER_SHIFT = 0.6  # samples: the lattice cuts its corners by half of one already
AREA = 1e-3  # relative; 100 points on a 100 mm curl cut 0.05 % short
MAX_SAG_RATIO = 1.5  # of the sag of equilateral triangles on the curl, for triangles of all shapes


@pytest.fixture(scope="session")
def curl(camera):
    """A sheet on a curl of 100 mm, and 5,600 nodes on it: (sheet, vertices, faces)."""
    inside = np.zeros(camera.shape, bool)
    inside[10:150, 15:185] = True
    sheet = camera.sheet(camera.facets(camera.cylinder(100.0)), inside)
    nodes, faces = lattice(inside, 2)
    return sheet, sheet.points(nodes), faces


def nodes_of(sheet, vertices):
    return np.stack(sheet.rays.grid(vertices), axis=1)


@pytest.mark.parametrize("own_vertices", [False, True])
@pytest.mark.parametrize("points", [60, 200, 1000, 4000])
def test_the_requested_number_of_points_is_left(curl, points, own_vertices):
    _, vertices, faces = curl
    left, joined = decimate(vertices, faces, points, own_vertices=own_vertices)
    assert len(left) == pytest.approx(points, rel=POINTS)
    np.testing.assert_array_equal(np.unique(joined), np.arange(len(left)))
    assert cKDTree(vertices).query(left)[0].max() == 0 or not own_vertices


@pytest.mark.parametrize("points", [100, 1000])
def test_the_shape_and_the_border_are_preserved(curl, points):
    sheet, vertices, faces = curl
    left, joined = decimate(vertices, faces, points)
    nodes = nodes_of(sheet, left)
    assert signed_areas(nodes[:, ::-1], joined).max() < 0  # rows run downwards: none is flipped over
    border = nodes[Topology(joined).border]
    sides = np.abs(border[:, [0, 0, 1, 1]] - [9.5, 149.5, 14.5, 184.5])
    assert sides.min(axis=1).max() < MAX_BORDER_SHIFT
    for corner in ([9.5, 14.5], [9.5, 184.5], [149.5, 14.5], [149.5, 184.5]):
        assert np.linalg.norm(border - corner, axis=1).min() < MAX_BORDER_SHIFT
    assert surface_area(left, joined) == pytest.approx(surface_area(vertices, faces), rel=AREA)
    side = np.sqrt(surface_area(vertices, faces) / points * 4 / 3**0.5 / 2)
    assert depth_distance(sheet, nodes, joined)["mean_mm"] < MAX_SAG_RATIO * side**2 / (8 * 100.0)


def test_curved_parts_of_the_sheet_keep_more_points(camera):
    bent = np.hstack([camera.plane()[:, :100], camera.cylinder(60.0)[:, 100:]])
    nodes, faces = lattice(np.ones(camera.shape, bool), 2)
    sheet = camera.sheet(camera.facets(bent))
    left, _ = decimate(sheet.points(nodes), faces, 300)
    columns = nodes_of(sheet, left)[:, 1]
    assert (columns > 100).sum() > 3 * (columns < 98).sum()


def test_a_mesh_of_no_more_points_than_requested_is_returned_unchanged(curl):
    _, vertices, faces = curl
    same = decimate(vertices, faces, len(vertices))
    assert same[0] is vertices
    assert same[1] is faces


def test_decimation_to_nothing_raises_not_enough_surface():
    """A strip of faces without any area: all of it collapses."""
    line = np.stack([np.arange(40.0), np.zeros(40), np.full(40, -900.0)], axis=1)
    faces = np.stack([np.arange(38), np.arange(1, 39), np.arange(2, 40)], axis=1)
    with pytest.raises(NotEnoughSurface, match="nothing of the mesh is left"):
        decimate(line, faces, 4)


def raw(camera, holes, seed=0):
    depth = camera.cylinder(100.0) + np.random.default_rng(seed).normal(0, camera.noise, camera.shape)
    depth[holes] = np.nan
    return triangulate(camera.shot(depth))


def test_small_holes_are_closed_and_tears_are_not(camera):
    rows, cols = camera.indices
    pinholes = (rows % 20 == 10) & (cols % 20 == 10)  # eight edges round each
    tear = (np.abs(rows - 80) < 2) & (np.abs(cols - 105) < 40)
    mesh = raw(camera, pinholes | tear)
    assert MAX_HOLE_EDGES < 2 * (3 + 79)
    _, faces = patch_and_smooth(mesh.vertices, mesh.faces)
    grid = np.stack(camera.rays.grid(mesh.vertices), axis=1).round()
    border = grid[Topology(faces).border]
    inner = (border > 0).all(axis=1) & (border < np.array(camera.shape) - 1).all(axis=1)
    assert inner.sum() > 150
    assert (np.abs(border[inner] - [80, 105]) <= [2, 40]).all()


def test_smoothing_reduces_noise_without_shrinking_and_keeps_vertices_near_their_positions(camera):
    mesh = raw(camera, np.zeros(camera.shape, bool))
    smooth, _ = patch_and_smooth(mesh.vertices, mesh.faces)
    assert smooth.shape == mesh.vertices.shape  # clean() takes texture coordinates over by number
    rows, cols = camera.rays.grid(smooth)
    inner = (rows > 5) & (rows < 154) & (cols > 5) & (cols < 194)
    radius = [np.hypot(v[inner, 0], v[inner, 2] + 921.5 + 100.0) for v in (mesh.vertices, smooth)]
    assert np.std(radius[1]) < 0.6 * np.std(radius[0])
    assert np.mean(radius[1]) == pytest.approx(100.0, abs=0.005)  # a tenth of the noise
    assert np.linalg.norm(smooth - mesh.vertices, axis=1)[inner].max() < camera.pitch_mm


def test_threads_decimate_one_at_a_time(curl):
    """Two at a time would damage the memory of the process."""
    _, vertices, faces = curl
    alone = decimate(vertices, faces, 300)
    with ThreadPoolExecutor(4) as pool:
        for together in pool.map(lambda _: decimate(vertices, faces, 300), range(8)):
            np.testing.assert_array_equal(together[0], alone[0])

"""Scans prepared to sheets: planes come back exact, holes are filled, and what is no page is refused."""

from dataclasses import replace

import numpy as np
import pytest

from restore.camera.rays import find_rays
from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.ordered_grid import grid_faces
from restore.prepared.facet_sheet import FacetSheet
from restore.prepared.plain_mesh import InterpolatedPage, PlainMesh
from restore.prepared.prepare import prepare
from restore.range_image.facets.sheet import WIDEST_STRIDE, Sheet
from restore.range_image.fit_sheet import fit_sheet
from restore.range_image.segmentation.segment import segment
from restore.scan import InterpolatedMesh, RangeScan, SurfaceMesh

TILT = (0.2, -0.1, 1.0)
EXACT_MM = 1e-3  # mm: facets are fitted in single precision of inverse depth, 4e-4 mm at 0.9 m
PAGE = (slice(30, 130), slice(40, 160))
HOLE = (slice(70, 76), slice(90, 97))
TEXTURE_PX = 1e-6  # an affine grid is continued by an affine fit, exact to rounding
# Drop-outs end a sample short of the ragged outline at most.
OUTLINE = 1.5


@pytest.fixture(scope="module")
def scan(camera) -> RangeScan:
    """A tilted page of 100 × 120 samples with a hole, nothing round it."""
    page = np.full(camera.shape, np.nan)
    page[PAGE] = camera.plane(TILT)[PAGE]
    page[HOLE] = np.nan
    return camera.shot(page)


@pytest.fixture(scope="module")
def sheet(scan) -> Sheet:
    prepared = prepare(scan)
    assert isinstance(prepared, FacetSheet)
    return prepared.sheet


def on_grid(mask):
    """Where the prepared sheet has a mask of the scan's grid: round the page and a cell beyond."""
    return mask[tuple(slice(span.start - WIDEST_STRIDE, span.stop + WIDEST_STRIDE) for span in PAGE)]


def test_the_sheet_is_inside_where_the_page_is_and_its_hole_too(camera, sheet):
    page = np.zeros(camera.shape, bool)
    page[PAGE] = True
    assert abs(int(sheet.inside.sum()) - int(page.sum())) < OUTLINE * 2 * (100 + 120)
    assert sheet.inside[on_grid(page)].mean() > 0.99
    hole = np.zeros(camera.shape, bool)
    hole[HOLE] = True
    assert sheet.inside[on_grid(hole)].all()
    assert not sheet.measured[on_grid(hole)].any()


def test_points_lie_on_the_plane_in_the_hole_as_elsewhere(sheet):
    nodes = np.argwhere(sheet.inside)[::11].astype(float)
    normal = np.array(TILT)
    distance = (sheet.points(nodes) @ normal + 921.5 * normal[2]) / np.linalg.norm(normal)
    assert np.abs(distance).max() < EXACT_MM


def test_texture_positions_are_continued_into_the_hole(sheet):
    rows, cols = np.nonzero(sheet.inside)
    first = PAGE[1].start - WIDEST_STRIDE, PAGE[0].start - WIDEST_STRIDE
    wanted = np.stack([cols, rows], axis=1) + first  # the camera here has one texture pixel for each sample
    np.testing.assert_allclose(sheet.pixels[rows, cols], wanted, atol=TEXTURE_PX)


def test_a_sheet_that_fills_the_grid_ends_beyond_it(camera):
    scan = camera.shot(camera.plane(TILT))
    rays = find_rays(scan)
    assert rays is not None
    sheet = fit_sheet(segment(scan, rays, scan.measured))
    rows, cols = camera.shape
    assert sheet.inside.shape == (rows + 2 * WIDEST_STRIDE, cols + 2 * WIDEST_STRIDE)
    corner = np.array([[WIDEST_STRIDE, WIDEST_STRIDE]])
    np.testing.assert_allclose(sheet.pixels[WIDEST_STRIDE, WIDEST_STRIDE], [0.0, 0.0], atol=TEXTURE_PX)
    np.testing.assert_allclose(sheet.points(corner.astype(float))[0], scan.points[0, 0], atol=EXACT_MM)


def test_the_scan_that_came_in_is_not_changed(scan):
    before = scan.points.copy()
    prepare(scan)
    np.testing.assert_array_equal(scan.points, before)


def test_a_scan_in_metres_is_refused_with_the_unit_to_give(scan):
    with pytest.raises(BadInput, match="mm") as refused:
        prepare(replace(scan, points=scan.points / 1000.0))
    assert "millimetres" in refused.value.hint


def test_a_scan_with_nothing_measured_has_not_enough_surface(scan):
    with pytest.raises(NotEnoughSurface):
        prepare(replace(scan, points=np.full_like(scan.points, np.nan)))


def test_a_small_mesh_stays_a_mesh_with_its_doubled_vertices_joined():
    corners = np.array([[0.0, 0, 0], [60, 0, 0], [60, 60, 0], [0, 0, 0], [60, 60, 0], [0, 60, 0]])
    prepared = prepare(SurfaceMesh(corners, np.array([[0, 1, 2], [3, 4, 5]])))
    assert isinstance(prepared, PlainMesh)
    assert (len(prepared.mesh.vertices), len(prepared.mesh.faces)) == (4, 2)


@pytest.mark.parametrize("alone", [True, False])
def test_a_flat_part_of_a_page_that_is_lit_otherwise_is_not_a_table(alone):
    """A leaflet of two panels, one half as wide as the other and in a light of its own; known to be alone, or not."""
    x, y = np.meshgrid(np.linspace(0.0, 180.0, 241), np.linspace(120.0, 0.0, 161))
    points = np.stack([x, y, 0.3 * np.maximum(120.0 - x, 0.0)], axis=-1).reshape(-1, 3)
    texture = np.full((160, 240, 3), 200, np.uint8)
    texture[:, 160:] = 120
    corners = np.stack([x, 120.0 - y], axis=-1).reshape(-1, 2) * 4.0 / 3.0 - 0.5
    mesh = points, grid_faces(np.ones(x.shape, bool)), corners, texture, {"unit": "mm", "unit_source": "given"}
    prepared = prepare(InterpolatedMesh(*mesh, points, 5.0) if alone else SurfaceMesh(*mesh))
    page = prepared.page if isinstance(prepared, InterpolatedPage) else prepared
    assert isinstance(page, FacetSheet)
    sheet = page.sheet
    assert np.ptp(sheet.points(np.argwhere(sheet.inside))[:, 0]) > 175.0


def test_a_mesh_in_map_coordinates_is_refused():
    vertices, faces = np.array([[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [0.0, 150.0, 0.0]]), np.array([[0, 1, 2]])
    prepare(SurfaceMesh(vertices + 9e4, faces))
    for far in (1e6, 5e8):
        with pytest.raises(BadInput, match="km from the origin") as refused:
            prepare(SurfaceMesh(vertices + far, faces))
        assert "subtract its middle" in refused.value.hint


def test_a_vertex_without_a_face_does_not_count_for_the_size():
    vertices = np.array([[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [0.0, 150.0, 0.0], [1e9, 0.0, 0.0]])
    prepare(SurfaceMesh(vertices, np.array([[0, 1, 2]])))

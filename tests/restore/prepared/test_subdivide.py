"""Cells of the fine mesh are split where the page is steep, and only there."""

import numpy as np
import pytest

from restore.mesh.measures import signed_areas
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.prepared.refine import NONLINEAR_MM, _split_faces, subdivide
from restore.range_image.facets.sheet import PageOnGrid, Sheet

RADIUS_MM = 50.0
STRIDE = 3
STEEP = 72.0  # degrees; a cell of three samples is 5 mm of the page here
# A page bends within a sample: at STEEP one of 0.47 mm is off a facet by 0.47² / 8 · sin / (RADIUS_MM · cos³), which is
# 0.018 mm, and so is its neighbour.
FACETS_MM = 0.036
SAME_AREA = 1e-9


def roll(camera):
    """A sheet on a cylinder up to STEEP on both sides, and its exact flat positions from grid positions."""
    inverse_depth = camera.cylinder(RADIUS_MM)
    x = (camera.directions[..., 0] / inverse_depth) / RADIUS_MM
    sheet = camera.sheet(camera.facets(inverse_depth), np.abs(x) < np.sin(np.radians(STEEP)))

    def flat_of(nodes):
        points = sheet.points(nodes)
        return np.column_stack([RADIUS_MM * np.arcsin(points[:, 0] / RADIUS_MM), points[:, 1]])

    return sheet, flat_of


def page_of(sheet: Sheet, flat_of) -> PageOnGrid:
    nodes, faces = lattice(sheet.inside, STRIDE)
    return PageOnGrid(flat_of(nodes), faces, nodes)


def middles_off(page, flat_of):
    """(e,) mm between the middles of edges on the page and the places of their middles in the picture."""
    edges = Topology(page.faces).edges
    return np.linalg.norm(page.flat[edges].mean(axis=1) - flat_of(page.nodes[edges].mean(axis=1)), axis=1)


@pytest.fixture(scope="module")
def split(camera):
    sheet, flat_of = roll(camera)
    page = page_of(sheet, flat_of)
    return page, subdivide(sheet, page), flat_of


def test_a_steep_page_is_linear_along_every_edge(split):
    before, after, flat_of = split
    assert middles_off(before, flat_of).max() > 5 * NONLINEAR_MM
    assert middles_off(after, flat_of).max() < NONLINEAR_MM + FACETS_MM


def test_the_new_vertices_are_where_they_belong(split):
    before, after, flat_of = split
    np.testing.assert_array_equal(after.nodes[: len(before.nodes)], before.nodes)
    assert np.abs(after.flat - flat_of(after.nodes)).max() < FACETS_MM


def test_the_middle_of_the_page_is_not_split(split):
    before, after, _ = split
    # A diagonal of two millimetres is off by NONLINEAR_MM at 25°, a third of STEEP.
    assert (np.abs(after.flat[len(before.nodes) :, 0]) > 0.3 * after.flat[:, 0].max()).all()


def test_a_plane_stays_as_it_is(camera):
    sheet = camera.sheet(camera.facets(camera.plane()))
    page = page_of(sheet, lambda nodes: sheet.points(nodes)[:, :2])
    after = subdivide(sheet, page)
    for name in ("flat", "faces", "nodes"):
        np.testing.assert_array_equal(getattr(page, name), getattr(after, name))


@pytest.mark.parametrize("chosen", range(1, 8))
def test_faces_with_one_two_and_three_split_sides_are_filled_without_overlap(chosen):
    corners = np.array([[0.0, 0.0], [4.0, 1.0], [1.0, 3.0]])
    split = np.array([bool(chosen & 1 << k) for k in range(3)])
    middles = 0.5 * (corners + np.roll(corners, -1, axis=0))[split]
    faces = _split_faces(np.array([[0, 1, 2]]), np.array([[0, 1, 2]]), split, 3)
    areas = signed_areas(np.concatenate([corners, middles]), faces)
    assert len(faces) == 1 + split.sum()
    assert areas.min() > 0.0
    assert areas.sum() == pytest.approx(5.5, rel=SAME_AREA)

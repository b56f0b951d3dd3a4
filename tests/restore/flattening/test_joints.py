"""Parts that hang by a point are flattened by themselves and lie on the page as they hang on the sheet."""

import numpy as np
import pytest

from restore.flattening.joints import parts
from restore.flattening.methods import flatten_points
from restore.mesh.network import make_network
from restore.mesh.topology import Topology
from restore.mesh.triangulate import compact
from restore.scan import SurfaceMesh

TRUE_MM = 0.01  # as for whole sheets
TURN_MM = 0.5  # a part turns as the faces beside its point do, which stand off the bend a little


@pytest.fixture
def hourglass(warped):
    """A curl, cut through above and below one vertex of its middle: its two halves hang together by that alone."""
    page = warped("curl", count=600)
    cut = page.flat[np.argmin(np.linalg.norm(page.flat - [20.0, 0.0], axis=1)), 0]
    across = page.flat[page.mesh.faces][..., 0]
    adjacent = (across.min(axis=1) >= cut) | (across.max(axis=1) <= cut)
    vertices, faces = compact(page.mesh.vertices, page.mesh.faces[adjacent])
    flat, _ = compact(page.flat, page.mesh.faces[adjacent])
    return flat, SurfaceMesh(vertices, faces)


def two_fans():
    """Two squares of two faces each that share vertex 2."""
    flat = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 1], [2, 2], [1, 2]], float)
    return flat, np.array([[0, 1, 2], [0, 2, 3], [2, 4, 5], [2, 5, 6]])


def test_parts_hang_together_over_edges():
    flat, faces = two_fans()
    edges = Topology(faces).edges
    lengths = np.arange(1.0, 1.0 + len(edges))
    found = list(parts(make_network(flat, Topology(faces), lengths)))
    assert [set(part.vertices) for part in found] == [{0, 1, 2, 3}, {2, 4, 5, 6}]
    for part in found:
        own = part.vertices[part.network.edges]
        index = [int(np.flatnonzero((edges == pair).all(axis=1))[0]) for pair in own]
        np.testing.assert_array_equal(part.network.lengths, lengths[index])


def test_a_whole_sheet_is_one_part(warped):
    page = warped("curl", count=100)
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces))
    (part,) = parts(network)
    assert part.network is network


@pytest.mark.parametrize("degrees", [0.0, 40.0, -70.0])
def test_a_part_goes_on_the_way_the_surface_does(degrees):
    """Two squares that share a corner, in one plane in space, however it lies: the second does not turn over it."""
    flat, faces = two_fans()
    angle = np.deg2rad(degrees)
    vertices = np.column_stack([flat[:, 0], flat[:, 1] * np.cos(angle), flat[:, 1] * np.sin(angle) - 900.0])
    page = flatten_points(SurfaceMesh(vertices, faces))
    ways = np.diff(page.flat[[0, 2, 5]], axis=0)
    np.testing.assert_allclose(ways[0], ways[1], atol=1e-6)


def test_a_sheet_cut_through_but_for_a_point_keeps_its_halves_in_line(hourglass):
    flat, mesh = hourglass
    halves = list(parts(make_network(mesh.vertices, Topology(mesh.faces))))
    assert len(halves) == 2
    assert len(np.intersect1d(*(half.vertices for half in halves))) == 1
    page = flatten_points(mesh)
    a, b = page.flat - page.flat.mean(axis=0), flat - flat.mean(axis=0)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    assert np.linalg.norm(a @ turn - b, axis=1).max() < TURN_MM


def test_a_closed_bubble_that_hangs_on_a_page_does_not_keep_it_from_its_place(warped):
    page = warped("curl", count=300)
    vertices, count = page.mesh.vertices, len(page.flat)
    bubble = vertices[0] + np.array([[9.0, 0, 0], [0, 9, 0], [0, 0, 9]])
    a, b, c = range(count, count + 3)
    faces = np.concatenate([page.mesh.faces, [[0, b, a], [0, a, c], [a, b, c], [0, c, b]]])
    found = flatten_points(SurfaceMesh(np.concatenate([vertices, bubble]), faces))
    assert page.error(found.flat[:count]) < TRUE_MM
    assert np.isfinite(found.flat).all()

"""Edges and pieces of a mesh."""

import numpy as np
import pytest

from restore.errors import BadInput
from restore.flattening.published.hinges import hinges_of
from restore.mesh.network import make_network, pieces
from restore.mesh.topology import Topology


def test_each_edge_is_there_once_in_ascending_order():
    faces = np.array([[3, 1, 2], [0, 2, 1], [4, 2, 0]])
    np.testing.assert_array_equal(Topology(faces).edges, [[0, 1], [0, 2], [0, 4], [1, 2], [1, 3], [2, 3], [2, 4]])


def test_without_lengths_the_straight_distances_are_taken(warped):
    page = warped("curl")
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces))
    straight = np.diff(page.mesh.vertices[network.edges], axis=1)[:, 0]
    np.testing.assert_array_equal(network.lengths, np.linalg.norm(straight, axis=1))
    np.testing.assert_array_equal(network.edges, Topology(page.mesh.faces).edges)


def test_a_face_that_names_a_vertex_twice_adds_no_edge():
    np.testing.assert_array_equal(Topology(np.array([[0, 1, 2], [1, 1, 2], [2, 2, 2]])).edges, [[0, 1], [0, 2], [1, 2]])


def test_two_vertices_at_one_place_leave_a_length_to_divide_by():
    network = make_network(np.zeros((3, 3)) + [[0], [0], [1]], Topology(np.array([[0, 1, 2]])))
    assert network.lengths.min() > 0
    assert np.isfinite(hinges_of(network)[1]).all()


NO_LENGTHS = [[], [1.0], [1, 1, np.nan], [1, 1, np.inf], [1, 1, -1], [0, 0, 0], [[1, 1, 1]]]
NO_LENGTHS += [3 * [length] for length in (1e300, 1e-300, "1", 1j)]


@pytest.mark.parametrize("lengths", NO_LENGTHS)
def test_lengths_that_are_not_one_for_each_edge_are_bad_input(lengths):
    with pytest.raises(BadInput, match="3 edges need 3 finite lengths"):
        make_network(np.eye(3), Topology(np.array([[0, 1, 2]])), lengths)


def test_lengths_may_come_as_a_list():
    np.testing.assert_array_equal(
        make_network(np.eye(3), Topology(np.array([[0, 1, 2]])), [1, 2, 2]).lengths, [1.0, 2.0, 2.0]
    )


def test_pieces_come_largest_first_with_their_own_numbers(warped):
    large, small = warped("curl", count=100), warped("fold", count=40)
    shift = len(large.mesh.vertices) + 2  # two vertices that no face uses
    vertices = np.vstack([large.mesh.vertices, np.zeros((2, 3)), small.mesh.vertices])
    faces = np.vstack([small.mesh.faces + shift, large.mesh.faces])
    network = make_network(vertices, Topology(faces))
    first, second = pieces(network)
    np.testing.assert_array_equal(first.vertices, np.arange(len(large.mesh.vertices)))
    np.testing.assert_array_equal(second.vertices, shift + np.arange(len(small.mesh.vertices)))
    for piece, page in ((first, large), (second, small)):
        alone = make_network(page.mesh.vertices, Topology(page.mesh.faces))
        np.testing.assert_array_equal(piece.faces, page.mesh.faces)
        for name in ("faces", "edges", "lengths"):
            np.testing.assert_array_equal(getattr(piece.network, name), getattr(alone, name))


def test_a_mesh_in_one_piece_is_its_own_piece(warped):
    page = warped("curl", count=100)
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces))
    (piece,) = pieces(network)
    assert piece.network is network


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.longdouble, np.int32])
def test_lengths_may_have_any_precision(warped, kind):
    mesh = warped("curl").mesh
    topology = Topology(mesh.faces)
    network = make_network(mesh.vertices, topology, np.full(len(topology.edges), 3, kind))
    assert network.lengths.dtype == np.float64
    np.testing.assert_array_equal(network.lengths, 3.0)

"""Hinges of a mesh, against geometry that is unfolded by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.flattening.published.hinges import hinges_of
from restore.mesh.network import make_network
from restore.mesh.topology import Topology

EXACT = 1e-9  # relative
NEEDLE = 1e-6  # mm: the height of a thin triangle is the root of a small difference

lengths = st.floats(1.0, 100.0)
angles = st.floats(np.deg2rad(15.0), np.deg2rad(150.0))


@settings(deadline=None)
@given(lengths, lengths, lengths, angles, angles, st.floats(-3.1, 3.1), st.permutations(range(4)))
def test_a_span_is_the_distance_over_the_unfolded_hinge(base, left, right, left_angle, right_angle, fold, names):
    """Two triangles on one base, folded by any angle, come to the same span as in the plane."""

    def corner(length, angle, lift):
        across = length * np.sin(angle)
        return [length * np.cos(angle), across * np.cos(lift), across * np.sin(lift)]

    folded = np.array([[0, 0, 0], [base, 0, 0], corner(left, left_angle, 0), corner(right, -right_angle, fold)])
    plane = np.array([corner(left, left_angle, 0), corner(right, -right_angle, 0)])
    names = np.array(names)
    vertices = np.empty((4, 3))
    vertices[names] = folded
    network = make_network(vertices, Topology(names[[[0, 1, 2], [1, 0, 3]]]))
    corners, spans = hinges_of(network)
    assert {*corners[0].tolist()} == {names[2], names[3]}
    assert spans[0] == pytest.approx(np.linalg.norm(plane[0] - plane[1]), rel=EXACT)


@pytest.mark.parametrize("shape", ["curl", "oblique wave", "gutter", "fold"])
def test_spans_come_from_the_lengths_and_not_from_the_warped_shape(warped, shape):
    page = warped(shape)
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths)
    corners, spans = hinges_of(network)
    flat = np.linalg.norm(page.flat[corners[:, 0]] - page.flat[corners[:, 1]], axis=1)
    np.testing.assert_allclose(spans, flat, atol=NEEDLE)
    bent = np.linalg.norm(np.diff(page.mesh.vertices[corners], axis=1)[:, 0], axis=1)
    assert (flat - bent).max() > 0.01


def test_a_closed_fan_has_a_hinge_on_every_inner_edge_and_none_on_the_border():
    around = np.deg2rad(60.0 * np.arange(6))
    vertices = np.vstack([[0, 0, 0], np.column_stack([np.cos(around), np.sin(around), 0 * around])])
    faces = np.array([[0, 1 + k, 1 + (k + 1) % 6] for k in range(6)])
    network = make_network(vertices, Topology(faces))
    assert len(network.edges) == 12
    corners, spans = hinges_of(network)
    assert sorted(sorted(pair) for pair in corners.tolist()) == [[1, 3], [1, 5], [2, 4], [2, 6], [3, 5], [4, 6]]
    np.testing.assert_allclose(spans, 3**0.5)


def test_an_edge_of_three_faces_is_not_a_hinge():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1, 0], [0.5, -1, 0], [0.5, 0, 1]])
    network = make_network(vertices, Topology(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])))
    assert len(hinges_of(network)[0]) == 0


def test_a_flat_sheet_has_no_creases(warped):
    page = warped("curl")
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces))
    corners, spans = hinges_of(network)
    assert len(corners) == len(spans) > 0
    assert [len(found) for found in hinges_of(network, bending=False)] == [0, 0]

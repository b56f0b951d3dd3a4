"""Inverted faces are turned back, but those that are folded over in space."""

from importlib import import_module

import numpy as np

from restore.flattening.isometric.gauss_newton import minimise_strain
from restore.flattening.isometric.page import least_absolute_page, least_strain_page
from restore.flattening.isometric.repair import inverted_count, opened, uninverted
from restore.flattening.isometric.repair import repaired as repaired_page
from restore.mesh.measures import edge_strain, flipped_faces, signed_areas, straight_lengths
from restore.mesh.network import make_network
from restore.mesh.topology import Topology

EXACT = 1e-12
KNOT_MM = 25.0  # two spacings: the point comes to lie beyond its neighbours
EASED = 0.01  # strain: its place among them is known, relaxation comes back to it
PARITY = 1e-9
FEW, WRONG = 0.05, 1.5  # of the lengths, and by what factor
SLIVER_MM = 0.01  # ten times the sliver's height


def repaired(page, flat):
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths)
    return uninverted(flat, network, np.ones(len(page.mesh.faces)))


def network_of(page, flat):
    """The network of a page that lies flat (n, 2) without strain."""
    lengths = straight_lengths(flat, Topology(page.mesh.faces).edges)
    return make_network(page.mesh.vertices, Topology(page.mesh.faces), lengths)


def unknotted(page, flat):
    return least_strain_page(flat, make_network(page.mesh.vertices, Topology(page.mesh.faces), page.lengths)).flat


def test_a_knot_inside_the_page_comes_undone(warped):
    page = warped(count=400)
    inner = np.argmin(np.linalg.norm(page.flat, axis=1))
    knotted = page.flat.copy()
    knotted[inner] += [40.0, 25.0]  # over its neighbours and theirs
    assert flipped_faces(knotted, page.mesh.faces) > 0
    flat = repaired(page, knotted)
    assert flipped_faces(flat, page.mesh.faces) == 0
    assert flipped_faces(unknotted(page, knotted), page.mesh.faces) == 0
    far = np.linalg.norm(page.flat, axis=1) > 100.0
    np.testing.assert_array_equal(flat[far], knotted[far])


def test_a_page_without_a_knot_stays_as_it_is(warped):
    page = warped(count=100)
    np.testing.assert_array_equal(repaired(page, page.flat), page.flat)


def test_a_page_that_was_knotted_is_hardly_stretched(warped):
    page = warped(count=400)
    edges = Topology(page.mesh.faces).edges
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    knotted = page.flat.copy()
    knotted[middle] += KNOT_MM
    flat = unknotted(page, knotted)
    assert np.abs(edge_strain(flat, edges, page.lengths)).max() < EASED


def test_an_inverted_sliver_is_opened_without_moving_the_rest():
    flat = np.array([[0, 0], [10, 0], [10, 10], [0, 10], [5, -0.001]], float)
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 4, 1]])  # the last is a sliver along the border
    vertices = np.column_stack([flat, np.zeros(5)])
    turned = flat.copy()
    turned[4, 1] = 0.001
    found = uninverted(turned, make_network(vertices, Topology(faces)), np.ones(3))
    assert flipped_faces(found, faces) == 0
    assert np.abs(found - flat).max() < SLIVER_MM


def test_mirrored_corners_of_the_border_come_back(warped):
    page = warped(count=100)
    faces = page.mesh.faces
    network = make_network(page.mesh.vertices, Topology(faces), page.lengths)
    corners = np.flatnonzero(np.bincount(faces.ravel()) == 1)  # of one face
    assert len(corners) > 0
    for corner in corners:
        flat = page.mirrored_at(corner)
        assert flipped_faces(flat, faces) == 1
        found = least_strain_page(flat, network).flat
        assert flipped_faces(found, faces) == 0
        assert np.abs(edge_strain(found, network.edges, page.lengths)).max() < EASED


def test_a_fold_that_lengths_ask_for_is_not_opened_at_the_price_of_strain(warped):
    page = warped(count=400)
    faces, flat = page.mesh.faces, page.folded_over()
    network = network_of(page, flat)
    found = minimise_strain(flat, network)
    assert inverted_count(found.flat, faces, np.ones(len(faces))) > 0
    assert opened(found, network, np.ones(len(faces))) is found


def test_a_face_that_its_lengths_turn_over_is_folded(warped):
    page = warped(count=400)
    faces, flat = page.mesh.faces, page.folded_over(1.8)
    network = network_of(page, flat)
    np.testing.assert_array_equal(repaired_page(flat, network, np.ones(len(faces))), flat)


def test_a_face_that_is_folded_in_space_stays_inverted(warped):
    page = warped(count=400)
    faces, flat = page.mesh.faces, page.folded_over()
    signs = np.where(signed_areas(flat, faces) < 0, -1.0, 1.0)
    assert (signs < 0).any()
    network = network_of(page, flat)
    found = least_strain_page(flat + 0.01, network, signs).flat
    np.testing.assert_array_equal(np.sign(signed_areas(found, faces)), signs)
    assert np.abs(edge_strain(found, network.edges, network.lengths)).max() < EXACT


def test_a_few_wrong_lengths_hardly_move_a_page_of_least_absolute_strain(warped):
    page = warped("gutter", count=300)
    wrong = np.random.default_rng(2).random(len(page.lengths)) < FEW
    network = make_network(page.mesh.vertices, Topology(page.mesh.faces), np.where(wrong, WRONG, 1.0) * page.lengths)
    squares, absolute = (
        float(np.median(np.linalg.norm(solve(page.flat, network).flat - page.flat, axis=1)))
        for solve in (least_strain_page, least_absolute_page)
    )
    assert absolute < 0.5 * squares


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped(count=60)
    knotted = page.flat.copy()
    knotted[int(np.argmin(np.linalg.norm(page.flat, axis=1)))] += 2 * KNOT_MM
    compiled = repaired(page, knotted)
    assert "_open" in plain(import_module("restore.flattening.isometric.repair"))
    np.testing.assert_allclose(compiled, repaired(page, knotted), atol=PARITY)

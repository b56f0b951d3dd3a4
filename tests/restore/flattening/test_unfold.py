"""Corners of the border that fell on their face are mirrored back."""

from importlib import import_module

import numpy as np

from restore.flattening.unfold import unfold, untangle
from restore.mesh.measures import edge_strain, flipped_faces, signed_areas
from restore.mesh.network import edges_of

EXACT = 1e-12
TANGLE_MM = 25.0  # two spacings: the point comes to lie beyond its neighbours
EASED = 0.01  # strain: its place among them is known, relaxation comes back to it
PARITY = 1e-9


def folded(flat, faces, face):
    """The page with the loosest corner of a face mirrored over the other two."""
    apex = face[np.argmin(np.bincount(faces.ravel())[face])]
    start, end = flat[face[face != apex]]
    along = (end - start) / np.linalg.norm(end - start)
    offset = flat[apex] - start
    spoilt = flat.copy()
    spoilt[apex] = start + 2 * (offset @ along) * along - offset
    return spoilt


def test_a_page_without_folds_stays_as_it_is(warped):
    page = warped(count=100)
    flat = page.flat.copy()
    assert unfold(flat, page.mesh.faces, edges_of(page.mesh.faces)) == 0
    np.testing.assert_array_equal(flat, page.flat)


def test_a_folded_corner_is_mirrored_back(warped):
    page = warped(count=100)
    faces, edges = page.mesh.faces, edges_of(page.mesh.faces)
    shared = np.bincount(faces.ravel())
    corners = faces[(shared[faces] == 1).any(axis=1)]  # faces with a corner of their own
    assert len(corners) > 0
    for face in corners:
        flat = folded(page.flat, faces, face)
        assert signed_areas(flat, faces).min() < 0
        assert unfold(flat, faces, edges) == 1
        np.testing.assert_allclose(flat, page.flat, atol=1e3 * EXACT)
        assert unfold(flat, faces, edges) == 0


def test_a_corner_of_two_flipped_faces_is_mirrored_once():
    flat = np.array([[0, 0], [2, 0], [4, 0], [2, -1], [0, -2], [2, -2], [4, -2], [-2, -1]], float)
    faces = np.array([[0, 1, 3], [1, 2, 3], [4, 5, 1], [4, 1, 0], [5, 6, 2], [5, 2, 1], [7, 4, 0]])
    assert unfold(flat, faces, edges_of(faces)) == 1
    np.testing.assert_allclose(flat[3], [2.0, 1.0], atol=EXACT)
    assert signed_areas(flat, faces).min() > 0


def test_a_corner_inside_the_page_is_not_mirrored(warped):
    page = warped(count=400)
    faces = page.mesh.faces
    shared = np.bincount(faces.ravel())
    inside = faces[np.argmin(np.linalg.norm(page.flat[faces].mean(axis=1), axis=1))]
    flat = folded(page.flat, faces, inside)
    spoilt = flat.copy()
    assert shared[inside].min() > 3
    assert unfold(flat, faces, edges_of(faces)) == 0
    np.testing.assert_array_equal(flat, spoilt)


def test_a_tangle_inside_the_page_comes_undone(warped):
    page = warped(count=400)
    edges = edges_of(page.mesh.faces)
    inner = np.argmin(np.linalg.norm(page.flat, axis=1))
    tangled = page.flat.copy()
    tangled[inner] += [40.0, 25.0]  # over its neighbours and theirs
    assert flipped_faces(tangled, page.mesh.faces) > 0
    flat = untangle(tangled, page.mesh.faces, edges, page.lengths)
    assert flipped_faces(flat, page.mesh.faces) == 0
    far = np.linalg.norm(page.flat, axis=1) > 100.0
    np.testing.assert_array_equal(flat[far], tangled[far])


def test_a_page_without_a_tangle_stays_as_it_is(warped):
    page = warped(count=100)
    np.testing.assert_array_equal(
        untangle(page.flat, page.mesh.faces, edges_of(page.mesh.faces), page.lengths), page.flat
    )


def test_a_page_that_was_tangled_is_hardly_stretched(warped):
    page = warped(count=400)
    edges = edges_of(page.mesh.faces)
    middle = int(np.argmin(np.linalg.norm(page.flat, axis=1)))
    tangled = page.flat.copy()
    tangled[middle] += TANGLE_MM
    flat = untangle(tangled, page.mesh.faces, edges, page.lengths)
    assert np.abs(edge_strain(flat, edges, page.lengths)).max() < EASED


def test_compiled_and_plain_python_agree(warped, plain):
    page = warped(count=60)
    edges = edges_of(page.mesh.faces)
    tangled = page.flat.copy()
    tangled[int(np.argmin(np.linalg.norm(page.flat, axis=1)))] += 2 * TANGLE_MM
    compiled = untangle(tangled, page.mesh.faces, edges, page.lengths)
    assert "ease" in plain(import_module("restore.flattening.unfold"))
    np.testing.assert_allclose(compiled, untangle(tangled, page.mesh.faces, edges, page.lengths), atol=PARITY)

"""Faces are turned to run the same way round, on the printed side."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.mesh.measures import signed_areas
from restore.mesh.orient import orient


def turned(faces, which):
    return np.where(which[:, None], faces[:, ::-1], faces)


def test_faces_that_agree_stay_as_they_are(warped):
    page = warped(count=60)
    np.testing.assert_array_equal(orient(page.mesh.faces), page.mesh.faces)
    np.testing.assert_array_equal(orient(page.mesh.faces, page.mesh.texcoords), page.mesh.faces)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_with_a_texture_any_mixture_comes_back_on_the_printed_side(warped, seed, share):
    page = warped(count=60)
    which = np.random.default_rng(seed).random(len(page.mesh.faces)) < share
    assert signed_areas(page.flat, orient(turned(page.mesh.faces, which), page.mesh.texcoords)).min() > 0


@pytest.mark.parametrize("share, side", [(0.3, 1.0), (0.7, -1.0)])
def test_without_one_most_faces_decide(warped, share, side):
    page = warped(count=60)
    which = np.arange(len(page.mesh.faces)) < share * len(page.mesh.faces)
    assert (side * signed_areas(page.flat, orient(turned(page.mesh.faces, which)))).min() > 0


def test_each_piece_decides_for_itself(warped):
    page = warped(count=60)
    faces = np.vstack([page.mesh.faces, page.mesh.faces[:, ::-1] + len(page.flat)])
    flat = np.vstack([page.flat, page.flat])
    np.testing.assert_array_equal(orient(faces), faces)
    texcoords = np.vstack([page.mesh.texcoords, page.mesh.texcoords])
    assert signed_areas(flat, orient(faces, texcoords)).min() > 0


def test_a_one_sided_strip_and_an_edge_of_three_faces_stay_as_they_are():
    strip = np.array([[k, k + 1, k + 20] for k in range(19)] + [[k + 20, k + 1, k + 21] for k in range(19)])
    closed = np.vstack([strip, [[19, 20, 39], [39, 20, 0]]])  # joined upside down, as Möbius did
    np.testing.assert_array_equal(orient(closed), closed)
    fins = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    np.testing.assert_array_equal(orient(fins), fins)

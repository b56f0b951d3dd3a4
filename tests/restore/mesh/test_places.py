"""Vertices at one place, and those of them in one chart."""

import numpy as np

from restore.mesh.places import first_at_place, first_in_chart


def test_vertices_at_one_place_have_one_first():
    vertices = np.array([[0.0, 1, 2], [-0.0, 1, 2], [2, 1, 0], [0, 1, 2]])
    assert first_at_place(vertices).tolist() == [0, 0, 2, 0]


def test_charts_at_one_place_are_distinguished_but_not_by_a_rounding_step():
    texcoords = np.array([[10.4999, 3.0], [10.5001, 3.0], [90.0, 7.0], [90.3, 7.2], [40.0, 3.0]])
    place = np.array([0, 0, 0, 0, 4])
    assert first_in_chart(place, texcoords).tolist() == [0, 0, 2, 2, 4]

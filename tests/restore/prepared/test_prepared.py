"""Which way up a page is: as its image shows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore.mesh.ordered_grid import grid_faces
from restore.page import FlatMesh
from restore.prepared.prepared import Unrolled, upright_as_textured

ROUNDING = 1e-9


def unrolled(turn_deg: float, whole: bool = True) -> Unrolled:
    """A page of 60 × 40 mm that its scan shows turned, counter-clockwise, from how its chart shows it."""
    place = np.stack(np.meshgrid(np.arange(31), np.arange(21)), axis=-1).reshape(-1, 2) * 2.0
    chart = place * 5.0  # pixels, y down
    angle = np.radians(turn_deg)
    flat = (place * [1.0, -1.0]) @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    faces = grid_faces(np.ones((21, 31), bool))
    if not whole:  # a corner is torn off
        faces = faces[place[faces].mean(axis=1).sum(axis=1) < 50.0]
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    mesh = FlatMesh(vertices, faces, chart, np.zeros((210, 310, 3), np.uint8), {}, flat, 1, np.empty(0))
    return Unrolled(mesh, mesh, np.empty((0, 2)), {})


def upright(page: Unrolled) -> np.ndarray:
    """How far (n, 2) mm the page lies from its chart."""
    flat, chart = page.fine.flat, page.fine.texcoords / 5.0 * [1.0, -1.0]
    return (flat - flat.mean(axis=0)) - (chart - chart.mean(axis=0))


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 180.0, -90.0])
def test_a_page_is_turned_by_right_angles_to_where_its_chart_is_upright(turn_deg):
    turned = upright_as_textured(unrolled(turn_deg))
    np.testing.assert_allclose(upright(turned), 0.0, atol=ROUNDING)
    assert turned.coarse is turned.fine


def test_a_fragment_is_turned_by_any_angle():
    fragment = unrolled(130.0, whole=False)
    np.testing.assert_allclose(upright(upright_as_textured(fragment)), 0.0, atol=ROUNDING)


def test_a_rectangle_that_its_chart_shows_a_little_tilted_stays():
    page = unrolled(3.0)
    assert upright_as_textured(page) is page


def test_an_atlas_of_charts_turned_every_way_says_nothing(rng):
    page = unrolled(90.0)
    chart = page.fine.texcoords.copy()
    for quarter in range(4):  # each its own way up
        strip = (page.fine.texcoords[:, 0] // 80).astype(int) == quarter
        here = chart[strip] - chart[strip].mean(axis=0)
        chart[strip] = here @ np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), quarter) + rng.uniform(0, 300, 2)
    mesh = replace(page.fine, texcoords=chart)
    shuffled = Unrolled(mesh, mesh, page.nodes, {})
    assert upright_as_textured(shuffled) is shuffled


def test_an_image_that_was_made_of_colours_of_vertices_says_nothing():
    page = unrolled(90.0)
    mesh = replace(page.fine, provenance={"oversampling": 1.5})
    painted = Unrolled(mesh, mesh, page.nodes, {})
    assert upright_as_textured(painted) is painted

"""Few points for many: they cover the sheet, and take all of it along."""

import numpy as np
import pytest

from restore.flattening import coarse as module
from restore.flattening.coarse import coarsen
from restore.mesh.measures import flipped_faces
from restore.mesh.network import make_network

COUNT = 3000
FEW = 500
TURNED_MM = 0.5  # where neighbours lie nearly in one plane, they do not quite tell what is across it
CARRIED_MM = 3.0  # a cell is 12 mm wide; between two of them a curl of 73 mm radius turns by 9 degrees
BENT = (
    0.25  # of what chords cut short is left by even bends; 0.17 measured, of normals at the border that know one side
)
PARITY = 1e-9


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


@pytest.fixture(scope="module")
def sheet(warped):
    page = warped("curl", count=COUNT)
    network = make_network(page.mesh.vertices, page.mesh.faces)
    return page, coarsen(page.mesh.vertices, network, FEW)


def test_the_few_are_as_many_as_asked_for_and_every_vertex_has_one(sheet):
    _, few = sheet
    assert FEW / 3 < len(few.index) <= FEW
    np.testing.assert_array_equal(few.owner[few.index], np.arange(len(few.index)))
    assert (few.owner >= 0).all()


def test_their_mesh_lies_the_right_way_round_without_a_fold(sheet):
    page, few = sheet
    assert flipped_faces(page.flat[few.index], few.network.faces) == 0
    assert len(np.unique(few.network.faces)) == len(few.index)


def test_they_are_as_far_apart_as_along_the_surface(sheet):
    page, few = sheet
    ends = few.index[few.network.edges]
    true = np.linalg.norm(page.flat[ends[:, 1]] - page.flat[ends[:, 0]], axis=1)
    chords = np.linalg.norm(page.mesh.vertices[ends[:, 1]] - page.mesh.vertices[ends[:, 0]], axis=1)
    assert rms(few.network.lengths / true - 1) < BENT * rms(chords / true - 1)


def test_moved_as_one_they_take_all_vertices_along(sheet):
    page, few = sheet
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    moved = page.mesh.vertices @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(few.carry(page.mesh.vertices, moved[few.index]), moved, atol=TURNED_MM)


def test_flattened_they_take_all_vertices_near_to_their_place(sheet):
    page, few = sheet
    assert page.error(few.carry(page.mesh.vertices, page.flat[few.index])) < CARRIED_MM


def test_a_strip_too_narrow_for_cells_is_left_alone():
    x = np.arange(200.0)
    vertices = np.concatenate([np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x, 0 * x + 1, 0 * x])])
    corner = np.arange(199)
    faces = np.concatenate(
        [np.column_stack([corner, corner + 1, corner + 201]), np.column_stack([corner, corner + 201, corner + 200])]
    )
    assert coarsen(vertices, make_network(vertices, faces), 20) is None


def test_compiled_and_plain_python_agree(sheet, plain):
    page, few = sheet
    network = make_network(page.mesh.vertices, page.mesh.faces)
    assert "_cells" in plain(module)
    again = coarsen(page.mesh.vertices, network, FEW)
    np.testing.assert_array_equal(again.owner, few.owner)
    np.testing.assert_allclose(again.network.lengths, few.network.lengths, atol=PARITY)

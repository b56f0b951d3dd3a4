"""Parts and loose triangles whose seams differ by rounding become one surface; what differs by more does not."""

import numpy as np
import pytest
import trimesh

from oracles.warped import make_warped
from restore.formats import load_scan
from restore.formats.cleaning.rounding import CROWDED, joined_by_rounding
from restore.mesh.adjacency import piece_of_faces
from restore.mesh.clean import weld
from restore.scan import SurfaceMesh

COLS, ROWS, STEP_MM = 31, 21, 5.0
TOUCHING = 1e-9  # mm: the mean of corners that noise has moved is nearer to the place than this, times the noise


@pytest.fixture
def loose(rng):
    """A curved sheet of triangles with corners of their own, each moved by noise of so many mm; and its vertices."""
    across, up = np.meshgrid(np.arange(COLS) * STEP_MM, np.arange(ROWS) * STEP_MM)
    vertices = np.stack([across, up, 10.0 * np.sin(across / 30.0)], axis=-1).reshape(-1, 3)
    number = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])

    def make(noise, texcoords=None):
        corners = vertices[faces].reshape(-1, 3)
        corners = corners + rng.normal(0.0, 1.0, corners.shape) * noise
        places = None if texcoords is None else texcoords(corners)
        texture = None if texcoords is None else np.zeros((200, 200, 3), np.uint8)
        return SurfaceMesh(corners, np.arange(len(corners)).reshape(-1, 3), places, texture)

    return make


def pieces(mesh):
    return len(np.unique(piece_of_faces(weld(mesh).faces)))


@pytest.mark.parametrize("noise", [1e-6, 1e-4, 2e-3, 0.05])
def test_triangles_that_noise_sets_apart_become_one_surface_with_a_warning(loose, noise):
    joined = joined_by_rounding(loose(noise))
    assert pieces(joined) == 1
    assert len(weld(joined).vertices) == ROWS * COLS
    (said,) = (one.text for one in joined.findings)
    assert "were joined" in said


@pytest.mark.parametrize("decimals", [1, 2, 4])
def test_coordinates_that_differ_by_their_last_decimal_are_one_place(loose, decimals):
    mesh = loose(0.3 * 10.0**-decimals)
    rounded = SurfaceMesh(np.round(mesh.vertices, decimals), mesh.faces)
    assert pieces(rounded) > 1
    assert pieces(joined_by_rounding(rounded)) == 1


@pytest.mark.parametrize("noise", [1.0, STEP_MM])
def test_triangles_that_lie_apart_by_more_stay_as_they_are(loose, noise):
    mesh = loose(noise)
    assert joined_by_rounding(mesh) is mesh


def test_a_whole_mesh_stays_as_it_is():
    mesh = make_warped("curl").mesh
    assert joined_by_rounding(mesh) is mesh


def test_seams_of_the_texture_stay(loose):
    mesh = loose(1e-4, texcoords=lambda corners: np.where(corners[:, :1] > 70.0, corners[:, :2] + 20.0, corners[:, :2]))
    joined = joined_by_rounding(mesh)
    assert joined.texcoords is mesh.texcoords
    assert len(weld(joined).vertices) > ROWS * COLS  # the places at the seam are there twice


def test_a_cloud_of_triangles_is_left_alone(rng):
    corners = rng.uniform(0.0, 1.0, (20 * CROWDED, 1, 3)) + rng.normal(0.0, 30.0, (20 * CROWDED, 3, 3)) * [1, 1, 0]
    mesh = SurfaceMesh(corners.reshape(-1, 3), np.arange(corners.shape[0] * 3).reshape(-1, 3))
    joined = joined_by_rounding(mesh)
    assert joined is mesh or pieces(joined) > len(corners) // 2


@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "glb"])
def test_every_format_is_joined(loose, ending, tmp_path):
    mesh = loose(1e-3)
    scale = 1e-3 if ending == "glb" else 1.0
    trimesh.Trimesh(mesh.vertices * scale, mesh.faces, process=False).export(tmp_path / f"a.{ending}")
    found = load_scan(tmp_path / f"a.{ending}")
    assert pieces(found) == 1
    assert "were joined" in found.findings[-1].text

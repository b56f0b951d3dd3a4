"""Cleaning removes debris and noise of a raw mesh and keeps its vertices, texture and pieces."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from restore.errors import NotEnoughSurface
from restore.mesh.clean import (
    MAX_PIECES,
    MIN_PIECE_FRACTION,
    RAW_RATIO,
    clean,
    large_pieces,
    select,
    weld,
    without_debris,
)
from restore.mesh.network import make_network, pieces
from restore.mesh.topology import Topology
from restore.mesh.triangulate import triangulate
from restore.mesh.validate import validated
from restore.scan import SurfaceMesh

POINTS = 0.05  # relative
MAX_SHIFT_SIGMAS = 4.0  # standard deviations: no vertex of 8,000 was further off


def raw(camera, *, noisy=True, inside=None, seed=0):
    depth = camera.cylinder(100.0)
    if noisy:
        depth = depth + np.random.default_rng(seed).normal(0, camera.noise, camera.shape)
    if inside is not None:
        depth = np.where(inside, depth, np.nan)
    return triangulate(replace(camera.shot(depth), texture=np.zeros(camera.shape + (3,), np.uint8)))


def count_pieces(mesh):
    return len(list(pieces(make_network(mesh.vertices, Topology(mesh.faces)))))


def test_a_coarse_mesh_is_returned_unchanged(camera):
    mesh = raw(camera)
    same = clean(mesh, len(mesh.vertices))
    for name in ("vertices", "faces", "texcoords", "texture"):
        np.testing.assert_array_equal(getattr(same, name), getattr(mesh, name))


def test_a_raw_mesh_is_smoothed_and_decimated_with_its_texture_coordinates(camera):
    mesh = raw(camera)
    points = len(mesh.vertices) // (2 * RAW_RATIO)
    cleaned = clean(mesh, points)
    assert len(cleaned.vertices) == pytest.approx(points, rel=POINTS)
    distance, _ = cKDTree(mesh.vertices).query(cleaned.vertices)
    sigma = camera.noise * 921.5**2
    assert 0 < distance.max() < MAX_SHIFT_SIGMAS * sigma
    rows, cols = camera.rays.grid(cleaned.vertices)
    near = np.abs(cleaned.texcoords - np.column_stack([cols, rows])).max(axis=1)
    assert near.max() < 1.0  # smoothing slides a vertex by less than a sample, and its texture stays with it
    assert cleaned.texture is mesh.texture
    radius = np.hypot(cleaned.vertices[:, 0], cleaned.vertices[:, 2] + 1021.5)
    assert np.std(radius) < 0.8 * np.std(np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 2] + 1021.5))


def test_a_slightly_dense_mesh_is_decimated_but_not_smoothed(camera):
    mesh = raw(camera)
    cleaned = clean(mesh, len(mesh.vertices) // 2)
    distance, index = cKDTree(mesh.vertices).query(cleaned.vertices)
    assert distance.max() == 0
    np.testing.assert_array_equal(cleaned.texcoords, mesh.texcoords[index])


def test_debris_is_dropped_and_the_pieces_of_a_torn_page_are_kept(camera):
    rows, cols = camera.indices
    halves = (np.abs(cols - 100 - 10 * np.sin(rows / 20)) > 2) & (cols > 20) & (rows > 20)
    scrap = (cols < 8) & (rows < 8)
    assert scrap.sum() < MIN_PIECE_FRACTION * halves.sum()
    mesh = raw(camera, inside=halves | scrap)
    assert count_pieces(mesh) == 3
    cleaned = clean(mesh, 1000)
    assert count_pieces(cleaned) == 2
    assert camera.rays.grid(cleaned.vertices)[1].min() > 19


def test_faces_that_name_a_vertex_twice_are_dropped(camera):
    mesh = raw(camera)
    flawed = replace(mesh, faces=np.vstack([mesh.faces, [[0, 0, 1], [5, 6, 5], [7, 8, 8]]]))
    np.testing.assert_array_equal(np.sort(clean(flawed, 40_000).faces, axis=0), np.sort(mesh.faces, axis=0))


def test_a_mesh_without_texture_is_cleaned_alike(camera):
    mesh = raw(replace(camera, rows=80, cols=100))
    bare = replace(mesh, texcoords=None, texture=None)
    cleaned = clean(bare, 500)
    assert cleaned.texcoords is None
    np.testing.assert_array_equal(cleaned.vertices, clean(mesh, 500).vertices)


def test_a_mesh_without_valid_faces_raises_not_enough_surface():
    with pytest.raises(NotEnoughSurface, match="no triangles"):
        clean(SurfaceMesh(np.zeros((3, 3)), np.array([[0, 1, 1], [2, 2, 0]])), 100)


def test_select_keeps_what_the_faces_use(camera):
    mesh = raw(camera)
    part = select(mesh, mesh.faces[100:120])
    np.testing.assert_array_equal(part.vertices[part.faces], mesh.vertices[mesh.faces[100:120]])
    np.testing.assert_array_equal(part.texcoords[part.faces], mesh.texcoords[mesh.faces[100:120]])
    np.testing.assert_array_equal(np.unique(part.faces), np.arange(len(part.vertices)))


def soup(mesh):
    """The same mesh with three vertices for every triangle, as STL and many exporters write it."""
    return replace(
        mesh,
        vertices=mesh.vertices[mesh.faces.ravel()],
        faces=np.arange(mesh.faces.size).reshape(-1, 3),
        texcoords=mesh.texcoords[mesh.faces.ravel()],
    )


def test_welding_merges_a_triangle_soup_to_one_sheet(camera):
    mesh = raw(replace(camera, rows=20, cols=30))
    assert count_pieces(soup(mesh)) == len(mesh.faces)
    welded = weld(soup(mesh))
    assert len(welded.vertices) == len(mesh.vertices)
    np.testing.assert_array_equal(welded.vertices[welded.faces], mesh.vertices[mesh.faces])
    np.testing.assert_array_equal(welded.texcoords[welded.faces], mesh.texcoords[mesh.faces])


def test_welding_keeps_texture_seams_and_welded_meshes_unchanged(camera):
    mesh = raw(replace(camera, rows=20, cols=30))
    assert weld(mesh) is mesh
    torn = soup(mesh)
    torn.texcoords[: mesh.faces.size // 2] += 100.0
    assert count_pieces(weld(torn)) == 2


def test_a_soup_of_disjoint_triangles_is_cleaned_without_a_crash(camera):
    cleaned = clean(soup(raw(replace(camera, rows=10, cols=10))), 10_000)
    assert len(cleaned.faces) == 2 * 9 * 9


def test_a_surface_in_scraps_is_refused(camera):
    mesh = validated(soup(raw(replace(camera, rows=40, cols=40))))
    assert len(mesh.faces) > MAX_PIECES
    with pytest.raises(NotEnoughSurface, match="its triangles do not hang together"):
        large_pieces(mesh)


@pytest.mark.parametrize(("loose", "said"), [(0.01, 0), (0.2, 1)])
def test_debris_that_is_left_out_is_said_where_it_is_much(camera, loose, said):
    mesh = raw(replace(camera, rows=40, cols=40))
    count = int(loose * len(mesh.faces))
    corners = mesh.vertices[mesh.faces[:count].ravel()] + [500.0, 0.0, 0.0]
    faces = np.concatenate([mesh.faces, len(mesh.vertices) + np.arange(3 * count).reshape(-1, 3)])
    whole, findings = without_debris(validated(SurfaceMesh(np.concatenate([mesh.vertices, corners]), faces)))
    assert len(findings) == said
    assert (len(whole.faces) == len(mesh.faces)) == bool(said)


def test_a_mesh_that_is_mostly_debris_is_refused(camera):
    mesh = raw(replace(camera, rows=40, cols=40))
    corners = mesh.vertices[mesh.faces.ravel()] * 1.1
    faces = np.concatenate([mesh.faces, len(mesh.vertices) + np.arange(mesh.faces.size).reshape(-1, 3)])
    with pytest.raises(NotEnoughSurface, match="in scraps"):
        without_debris(validated(SurfaceMesh(np.concatenate([mesh.vertices, corners]), faces)))

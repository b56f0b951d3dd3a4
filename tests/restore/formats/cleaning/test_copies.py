"""Doubled faces and double-sided exports."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore import Settings, restore
from restore.formats import load_scan, write_obj
from restore.formats.cleaning.copies import merge_copies
from restore.formats.parsing.mesh import PaintedMesh
from restore.scan import SurfaceMesh

COLS, ROWS = 12, 9


def sheet():
    """A curl of 108 vertices with a texture coordinate and a colour for each."""
    across, down = np.meshgrid(np.linspace(-1, 1, COLS), np.linspace(1, -1, ROWS))
    vertices = np.stack([80 * np.sin(across), 60 * down, 80 * np.cos(across) - 600], axis=-1).reshape(-1, 3)
    index = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    colours = np.arange(3 * len(vertices)).reshape(-1, 3).astype(np.uint8)
    return PaintedMesh(vertices, faces, vertices[:, :2].copy(), np.zeros((4, 4, 3), np.uint8), {}, colours)


def doubled(mesh, *, own_vertices, turned):
    """The mesh with every face twice, the second time turned, or with vertices of its own."""
    count = len(mesh.vertices) if own_vertices else 0
    copies = (mesh.faces[:, ::-1] if turned else mesh.faces) + count
    twice = (lambda values: np.concatenate([values, values])) if own_vertices else (lambda values: values)
    return replace(
        mesh,
        vertices=twice(mesh.vertices),
        faces=np.concatenate([mesh.faces, copies]),
        texcoords=twice(mesh.texcoords),
        colours=twice(mesh.colours),
    )


@pytest.mark.parametrize("own_vertices", [False, True])
@pytest.mark.parametrize("turned", [False, True])
def test_every_face_comes_back_once(own_vertices, turned):
    mesh = sheet()
    back = merge_copies(doubled(mesh, own_vertices=own_vertices, turned=turned))
    for name in ("vertices", "faces", "texcoords", "colours"):
        np.testing.assert_array_equal(getattr(back, name), getattr(mesh, name))
    assert [one.text for one in back.findings] == [
        f"{len(mesh.faces)} duplicate faces were merged, as of a double-sided export"
    ]


def test_a_back_with_another_part_of_the_picture_is_merged():
    mesh = doubled(sheet(), own_vertices=True, turned=True)
    mesh.texcoords[len(mesh.vertices) // 2 :] += 500
    np.testing.assert_array_equal(merge_copies(mesh).texcoords, sheet().texcoords)


def test_a_mesh_without_copies_is_returned_as_it_is():
    mesh = sheet()
    assert merge_copies(mesh) is mesh


@settings(deadline=None, max_examples=50)
@given(data=st.data())
def test_faces_of_different_places_all_stay(data):
    """Against comparison of all pairs, on coordinates of few values, where badly mixed hashes collide."""
    count = data.draw(st.integers(3, 12))
    values = st.sampled_from([0.0, -0.0, 1.0, 2.0, 0.5, 256.0])
    vertices = np.array(data.draw(st.lists(st.tuples(values, values, values), min_size=count, max_size=count)))
    corner = st.integers(0, count - 1)
    faces = np.array(data.draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=30)))
    back = merge_copies(PaintedMesh(vertices, faces))
    kept = [sorted(map(tuple, vertices[face] + 0.0)) for face in faces]
    distinct = [key for at, key in enumerate(kept) if key not in kept[:at]]
    assert [sorted(map(tuple, back.vertices[face] + 0.0)) for face in back.faces] == distinct


def test_a_double_sided_file_is_restored_with_a_warning(tmp_path):
    mesh = doubled(sheet(), own_vertices=True, turned=True)
    write_obj(SurfaceMesh(mesh.vertices, mesh.faces), tmp_path / "page.obj")
    page = restore(load_scan(tmp_path / "page.obj"), Settings(dpi=50))
    assert any("double-sided" in one["text"] for one in page.report["findings"])
    np.testing.assert_allclose(page.report["page_mm"], [160, 120], atol=0.5)


def test_two_opposed_triangles_are_one(tmp_path):
    corners = np.array([[0, 0, 0], [100, 0, 0], [100, 80, 0]], float)
    write_obj(SurfaceMesh(np.concatenate([corners, corners]), np.array([[0, 1, 2], [5, 4, 3]])), tmp_path / "a.obj")
    assert restore(load_scan(tmp_path / "a.obj"), Settings(dpi=50)).report["area_ratio"] == pytest.approx(1.0)

"""Meshes of a sheet, read again by another program: the same surface in the unit of the format."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from restore import load_scan
from station.archive.sheets import METRES, encode_glb, encode_ply, encode_sheet, surface_of
from tests.station.conftest import COLS, HEIGHT_MM, RADIUS_MM, ROWS, WIDTH_MM, curl_scan

FLOAT32_MM = 1e-3  # glTF positions are 32 bits: 24 bits of a metre are 0.06 µm; the scan stands 0.9 m away
DIGITS_MM = 1e-6  # of an OBJ


@pytest.fixture
def mesh():
    return surface_of(curl_scan())


def area_mm2(vertices, faces) -> float:
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_every_cell_of_a_grid_is_covered_once(mesh) -> None:
    assert len(mesh.faces) == 2 * (ROWS - 1) * (COLS - 1)
    step = WIDTH_MM / (COLS - 1) / RADIUS_MM
    chord = 2 * RADIUS_MM * np.sin(step / 2) * (COLS - 1)  # the facets of a cylinder are narrower than the arc
    assert area_mm2(mesh.vertices, mesh.faces) == pytest.approx(chord * HEIGHT_MM)
    edges = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert np.unique(edges, axis=0, return_counts=True)[1].max() == 2


def test_its_front_is_towards_the_scanner(mesh) -> None:
    a, b, c = (mesh.vertices[mesh.faces[:, corner]] for corner in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


@pytest.mark.parametrize("corner", [(4, 5), (4, 6), (5, 5), (5, 6)])
def test_a_cell_with_a_hole_at_one_corner_keeps_its_other_half(corner) -> None:
    scan = curl_scan()
    points = scan.points.copy()
    points[corner] = np.nan
    mesh = surface_of(replace(scan, points=points))
    assert len(mesh.faces) == 2 * (ROWS - 1) * (COLS - 1) - 4  # four cells have lost one of two triangles
    assert np.isfinite(mesh.vertices).all()
    assert len(np.unique(mesh.faces)) == len(mesh.vertices) == ROWS * COLS - 1


def test_only_samples_of_the_page_are_in_its_mesh() -> None:
    within = np.zeros((ROWS, COLS), bool)
    within[3:8, 4:9] = True
    mesh = surface_of(curl_scan(), within)
    assert len(mesh.vertices) == 5 * 5
    assert len(mesh.faces) == 2 * 4 * 4


def test_glb_is_in_metres_with_its_texture(mesh) -> None:
    scene = trimesh.load(io.BytesIO(encode_glb(mesh)), file_type="glb")
    (read,) = scene.geometry.values()
    np.testing.assert_allclose(np.asarray(read.vertices) / METRES, mesh.vertices, atol=FLOAT32_MM)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    np.testing.assert_array_equal(np.asarray(read.visual.material.baseColorTexture), mesh.texture)


def test_glb_is_read_as_a_scan_again(mesh, tmp_path) -> None:
    (tmp_path / "sheet.glb").write_bytes(encode_glb(mesh))
    again = load_scan(tmp_path / "sheet.glb")
    vertices, faces = (again.vertices, again.faces) if hasattr(again, "faces") else (None, None)
    assert area_mm2(vertices, faces) == pytest.approx(area_mm2(mesh.vertices, mesh.faces), rel=1e-4)


def test_ply_has_the_colours_of_the_texture(mesh) -> None:
    read = trimesh.load(io.BytesIO(encode_ply(mesh)), file_type="ply", process=False)
    np.testing.assert_array_equal(np.asarray(read.vertices), mesh.vertices)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    x, y = mesh.texcoords.astype(int).T
    np.testing.assert_array_equal(read.visual.vertex_colors[:, :3], mesh.texture[y, x])


def test_obj_comes_with_its_material_and_texture(mesh, tmp_path) -> None:
    files = dict(encode_sheet(mesh, "0001"))
    assert sorted(files) == ["0001.glb", "0001.mtl", "0001.obj", "0001.ply", "0001.png"]
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    read = trimesh.load(tmp_path / "0001.obj", process=False)
    np.testing.assert_allclose(np.asarray(read.vertices), mesh.vertices, atol=DIGITS_MM)
    np.testing.assert_array_equal(np.asarray(read.visual.material.image)[..., :3], mesh.texture)


def test_a_sheet_without_colour_has_no_texture() -> None:
    bare = replace(surface_of(curl_scan()), texture=None)
    assert sorted(name for name, _ in encode_sheet(bare, "1")) == ["1.glb", "1.obj", "1.ply"]

"""A page that other programs have saved again, in each format that they write and Planish reads, is the same page."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from restore import SurfaceMesh, load_scan, restore
from restore.formats import write_obj
from restore.mesh.ordered_grid import grid_faces
from restore.runtime.native import load_open3d, load_pymeshlab
from restore.settings import Settings

PAGE_MM = (150.0, 100.0)
SIZE_MM = 0.01
MIN_ALIKE = 0.8  # correlation with the image: vertices have a colour for every 5 mm
TEXTURED, COLOURED = "textured", "colours of vertices"


@pytest.fixture(scope="module")
def page() -> SurfaceMesh:
    """A page of 150 × 100 mm on a cylinder, its image darker to the left and with a red corner at the top."""
    along, across = np.meshgrid(np.linspace(0, 150, 31), np.linspace(0, 100, 21))
    angle = along / 200.0
    vertices = np.stack([200 * np.sin(angle), -across, 200 * np.cos(angle)], axis=-1).reshape(-1, 3)
    image = np.repeat(np.linspace(60, 250, 300).astype(np.uint8)[None, :, None], 200, axis=0).repeat(3, axis=2)
    image[:60, 200:] = (200, 30, 30)
    places = np.stack([along, across], axis=-1).reshape(-1, 2) * [299 / 150, 199 / 100]
    return SurfaceMesh(vertices, grid_faces(np.ones(along.shape, bool)), places, image)


def colours_of(page: SurfaceMesh) -> np.ndarray:
    """(n, 3) uint8: of the vertices."""
    x, y = np.rint(page.texcoords).astype(int).T
    return page.texture[y, x]


def saved_by_trimesh(page, source, path, kind):
    trimesh = pytest.importorskip("trimesh")
    if kind == TEXTURED:
        mesh = trimesh.load(source, process=False)
    else:
        mesh = trimesh.Trimesh(page.vertices, page.faces, vertex_colors=colours_of(page), process=False)
    if path.suffix == ".gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
            (path if name.endswith(".gltf") else path.with_name(name)).write_bytes(data)
    else:
        mesh.export(path)


def saved_by_pymeshlab(page, source, path, kind):
    pymeshlab = load_pymeshlab()
    meshes = pymeshlab.MeshSet()
    if kind == TEXTURED:
        meshes.load_new_mesh(str(source))
    else:
        colours = np.column_stack([colours_of(page) / 255.0, np.ones(len(page.vertices))])
        meshes.add_mesh(pymeshlab.Mesh(page.vertices, page.faces, v_color_matrix=colours))
    meshes.save_current_mesh(str(path))


def saved_by_open3d(page, source, path, kind):
    open3d = load_open3d()
    if kind == TEXTURED:
        mesh = open3d.io.read_triangle_mesh(str(source), True)
    else:
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(page.vertices), open3d.utility.Vector3iVector(page.faces)
        )
        mesh.vertex_colors = open3d.utility.Vector3dVector(colours_of(page) / 255.0)
    mesh.compute_vertex_normals()
    assert open3d.io.write_triangle_mesh(str(path), mesh)


# Those that a program writes with the colours of the kind: textures of PLY and glTF it may leave out.
SAVED = [
    *((saved_by_trimesh, TEXTURED, suffix) for suffix in (".obj", ".glb", ".gltf")),
    *((saved_by_trimesh, COLOURED, suffix) for suffix in (".obj", ".ply", ".glb", ".gltf")),
    *((saved_by_pymeshlab, kind, suffix) for kind in (TEXTURED, COLOURED) for suffix in (".obj", ".ply")),
    (saved_by_open3d, TEXTURED, ".obj"),
    *((saved_by_open3d, COLOURED, suffix) for suffix in (".obj", ".ply", ".glb", ".gltf")),
    *((program, TEXTURED, ".stl") for program in (saved_by_trimesh, saved_by_pymeshlab, saved_by_open3d)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("program", "kind", "suffix"), SAVED)
def test_a_page_saved_by_another_program_is_the_same_page(page, tmp_path, program, kind, suffix):
    (tmp_path / "source").mkdir()
    write_obj(page, tmp_path / "source" / "page.obj")
    program(page, tmp_path / "source" / "page.obj", tmp_path / f"page{suffix}", kind)
    found = restore(load_scan(tmp_path / f"page{suffix}"), Settings(dpi=72))
    np.testing.assert_allclose(found.report["page_mm"], PAGE_MM, atol=SIZE_MM)
    if suffix != ".stl":  # which has no colours
        assert alike(found.image, page.texture) > MIN_ALIKE
        assert alike(found.image[:, ::-1], page.texture) < MIN_ALIKE


def alike(image: np.ndarray, other: np.ndarray) -> float:
    """The correlation of two images at 5 mm to a pixel."""
    small = [cv2.resize(one, (30, 20), interpolation=cv2.INTER_AREA).astype(float).ravel() for one in (image, other)]
    return float(np.corrcoef(*small)[0, 1])

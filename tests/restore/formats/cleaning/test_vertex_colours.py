"""Colours of vertices become a picture: the page shows them, as fine as the vertices lie and no finer."""

import numpy as np
import pytest
import trimesh

from restore import Settings, restore, rotate_page
from restore.camera.pinhole import pinhole_camera
from restore.formats import load_scan
from restore.formats.gltf.glb import read_glb
from restore.formats.ply import read_ply
from restore.formats.vrml import read_vrml
from restore.mesh.ordered_grid import grid_faces
from restore.scan import SurfaceMesh
from restore.texture.occlusion import viewpoint

WIDTH, HEIGHT, RADIUS = 120.0, 160.0, 90.0  # mm
INCH = 25.4
COARSE, DENSE = (41, 53), (170, 230)  # vertices along either side; a dense mesh is seen from one view
CODES = 6.0  # of 255: waves that are sampled six times by the vertices and painted twice
FINENESS = 0.05  # of the resolution: cells of triangles are no squares
DPI = 60


def waves(across, down):
    """(n, 3) colours, 0…255, at places of the page in mm."""
    parts = [np.sin(across / 7.0), np.cos(down / 9.0), np.sin((across + 2 * down) / 31.0)]
    return np.rint(127.5 + 110.0 * np.stack(parts, axis=-1)).astype(np.uint8)


def curl(shape, tilt=0.3):
    """Vertices (n, 3) mm of a page bent to a cylinder and tilted, its faces, and places (n, 2) mm on the page."""
    across, down = (
        axis.ravel() for axis in np.meshgrid(np.linspace(0, WIDTH, shape[0]), np.linspace(0, HEIGHT, shape[1]))
    )
    angle = (across - WIDTH / 2) / RADIUS
    upright = np.stack([RADIUS * np.sin(angle), -down, RADIUS * np.cos(angle)], axis=-1)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    faces = grid_faces(np.ones((shape[1], shape[0]), bool))
    return upright @ turn.T - [0, 0, 500], faces, np.stack([across, down], axis=-1)


def write(path, vertices, faces, colours):
    """A PLY text with a colour for each vertex."""
    names = [f"property float {axis}" for axis in "xyz"] + [
        f"property uchar {name}" for name in ("red", "green", "blue")
    ]
    head = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}", *names]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    points = [f"{x:.5f} {y:.5f} {z:.5f} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(vertices, colours, strict=True)]
    path.write_text("\n".join([*head, *points, *("3 {} {} {}".format(*face) for face in faces)]) + "\n")
    return path


@pytest.mark.parametrize(
    "line",
    [
        "v {x} {y} {z} {r} {g} {b}",
        "v {x} {y} {z} {r} {g} {b} 1.0",
        "v {x} {y} {z} {r} {g} {b} 0.5",
        "v {x} {y} {z} 1.0 {r} {g} {b}",
        "v {x} {y} {z} 1 {r} {g} {b}",
    ],
)
def test_colours_of_an_obj_are_read_before_an_opacity_and_behind_a_weight(tmp_path, line):
    picture = np.unique(load_scan(write_obj(tmp_path, line, [(255, 0, 51)] * 6 + [(0, 204, 102)] * 6)).texture)
    assert {0, 51, 102, 204, 255} <= set(picture.tolist())
    assert picture.max() == 255


def test_colours_of_an_obj_that_could_be_read_in_two_ways_are_not_used(tmp_path):
    path = write_obj(tmp_path, "v {x} {y} {z} {r} {g} {b} 1.0", [(255, 0, 51)] * 6 + [(255, 204, 51)] * 6)
    mesh = load_scan(path)
    assert mesh.texture is None
    assert [one.code for one in mesh.findings] == ["colours_ambiguous"]


def write_obj(tmp_path, line, colours):
    """A page of 4 × 3 vertices, whose lines are written as asked for, with colours of 0 to 1."""
    vertices = [(10 * (k % 4), 10 * (k // 4), 0) for k in range(12)]
    lines = [
        line.format(x=x, y=y, z=z, r=r / 255, g=g / 255, b=b / 255)
        for (x, y, z), (r, g, b) in zip(vertices, colours, strict=True)
    ]
    lines += ["f {} {} {}".format(*(face + 1)) for face in grid_faces(np.ones((3, 4), bool))]
    path = tmp_path / "page.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("kind", "names", "scale"),
    [
        ("uchar", ("red", "green", "blue"), 1),
        ("uchar", ("diffuse_red", "diffuse_green", "diffuse_blue"), 1),
        ("uchar", ("r", "g", "b"), 1),
        ("ushort", ("red", "green", "blue"), 257),
        ("float", ("red", "green", "blue"), 1 / 255),
    ],
)
def test_colours_are_read_under_their_names_and_of_their_types(tmp_path, kind, names, scale):
    vertices, faces, places = curl(COARSE)
    colours = waves(*places.T)
    path = write(tmp_path / "page.ply", vertices, faces, colours.astype(int) * scale)
    text = path.read_text()
    for usual, name in zip(("red", "green", "blue"), names, strict=True):
        text = text.replace(f"property uchar {usual}\n", f"property {kind} {name}\n")
    path.write_text(text)
    np.testing.assert_allclose(read_ply(path).colours, colours, atol=0.5)


def test_colours_next_to_a_material_are_read(tmp_path):
    vertices, faces, places = curl(COARSE)
    colours = np.column_stack([waves(*places.T), np.full(len(places), 255, np.uint8)])
    mesh = trimesh.Trimesh(vertices / 1000.0, faces, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=trimesh.visual.material.PBRMaterial())
    mesh.visual.vertex_attributes["color"] = colours
    mesh.export(tmp_path / "page.glb")
    np.testing.assert_array_equal(read_glb(tmp_path / "page.glb").colours, colours[:, :3])


@pytest.mark.parametrize(
    ("binding", "index", "coloured"),
    [
        ("PER_VERTEX_INDEXED", "", True),
        ("PER_VERTEX", "materialIndex [ 0, 1, 2, -1, 0, 2, 3, -1 ]", True),
        ("PER_VERTEX_INDEXED", "materialIndex [ 0, 0, 0, -1, 1, 1, 1, -1 ]", False),
        ("OVERALL", "", False),
    ],
)
def test_colours_of_vrml_are_read_where_they_are_those_of_its_vertices(tmp_path, binding, index, coloured):
    (tmp_path / "page.wrl").write_text(
        "#VRML V1.0 ascii\nSeparator {\nMaterial { diffuseColor [ 1 0 0, 0 1 0, 0 0 1, 1 1 1 ] }\n"
        f"MaterialBinding {{ value {binding} }}\nCoordinate3 {{ point [ 0 0 -9, 9 0 -9, 9 9 -9, 0 9 -9 ] }}\n"
        f"IndexedFaceSet {{ coordIndex [ 0, 1, 2, -1, 0, 2, 3, -1 ] {index} }}\n}}\n"
    )
    colours = read_vrml(tmp_path / "page.wrl").colours
    assert (colours is not None) is coloured
    assert not coloured or colours.tolist() == [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]]


def loaded(folder, shape, *, soup=False):
    vertices, faces, places = curl(shape)
    colours = waves(*places.T)
    if soup:
        vertices, colours, faces = vertices[faces].reshape(-1, 3), colours[faces].reshape(-1, 3), np.arange(faces.size)
    return load_scan(write(folder / "page.ply", vertices, faces.reshape(-1, 3), colours))


@pytest.mark.parametrize(("shape", "soup"), [(COARSE, False), (COARSE, True), (DENSE, False)])
def test_the_page_shows_the_colours_of_the_vertices(tmp_path, shape, soup):
    mesh = loaded(tmp_path, shape, soup=soup)
    assert isinstance(mesh, SurfaceMesh) and len(mesh.vertices) == shape[0] * shape[1]
    page = restore(mesh, Settings(dpi=DPI))
    y, x = np.mgrid[4 : page.image.shape[0] - 4, 4 : page.image.shape[1] - 4]
    expected = waves((x + 0.5) * INCH / DPI, (y + 0.5) * INCH / DPI)
    shown = page.image[y, x].astype(float)
    assert np.sqrt(((shown - expected) ** 2).mean()) < CODES
    assert page.report["coverage"]["occluded"] == 0.0


@pytest.mark.parametrize("shape", [COARSE, DENSE])
def test_the_page_resolves_what_the_vertices_do(tmp_path, shape):
    report = restore(loaded(tmp_path, shape), Settings(dpi=DPI)).report
    vertices_per_inch = INCH * np.sqrt((shape[0] - 1) * (shape[1] - 1) / (WIDTH * HEIGHT))
    assert report["sampling_ppi"] == pytest.approx(vertices_per_inch, rel=FINENESS)
    assert report["resolved_ppi"] is None or report["resolved_ppi"] <= report["sampling_ppi"]
    assert report["findings"] == []
    assert report["source"]["texture_source"] == "colours of vertices"


def test_the_page_is_turned_and_its_colours_with_it(tmp_path):
    page = restore(loaded(tmp_path, COARSE), Settings(dpi=DPI))
    np.testing.assert_array_equal(rotate_page(page, 90).image, np.rot90(page.image, -1))


def test_no_camera_is_found_in_a_painted_picture(tmp_path):
    mesh = loaded(tmp_path, COARSE)
    page = restore(mesh).fine
    assert pinhole_camera(page.vertices, page.texcoords) is not None  # a page so even fits one by chance
    assert viewpoint(page) is None


def test_colours_of_a_surface_that_cannot_be_flattened_are_reported_as_omitted(tmp_path):
    angle = np.arange(24) * (2 * np.pi / 24)
    ring = np.stack([60 * np.cos(angle), 60 * np.sin(angle), 0 * angle - 500], axis=-1)
    here, there = np.arange(24), np.roll(np.arange(24), -1)
    band = np.concatenate([np.stack([here, there, here + 24], 1), np.stack([there, there + 24, here + 24], 1)])
    vertices = np.concatenate([ring, ring + [0, 0, 20]])
    mesh = load_scan(write(tmp_path / "band.ply", vertices, band, np.arange(3 * 48).reshape(-1, 3)))
    assert mesh.texture is None and len(mesh.vertices) == 48
    assert mesh.findings[0].text.startswith("the vertex colours are not used, because the surface cannot")

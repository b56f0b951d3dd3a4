"""Stanford polygon files."""

import numpy as np
import pytest
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan, referenced_files, write_ply
from restore.formats.ply import read_ply
from restore.scan import RangeScan, SurfaceMesh

EXACT_PX = 1e-9  # rounding of a division by the picture's size and back

HEAD = "ply\nformat ascii 1.0\ncomment made by hand\n"
POINTS = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face 2\nproperty list uchar int vertex_indices\n"
SQUARE = ("0 0 -700", "9 0 -700", "9 9 -700", "0 9 -700")
TRIANGLES = ("3 0 1 2", "3 0 2 3")


def text(*lines, head=HEAD + POINTS + FACES):
    return head + "end_header\n" + "\n".join(lines) + "\n"


def test_a_mesh_comes_back_exactly_on_its_grid(mesh, shot, tmp_path):
    write_ply(mesh(rows=24, cols=32), tmp_path / "page.ply")
    back, scan = load_scan(tmp_path / "page.ply"), shot(24, 32)
    assert isinstance(back, RangeScan)
    seen = back.measured
    np.testing.assert_array_equal(back.points[seen], scan.points[seen])
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=EXACT_PX, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)


@pytest.mark.parametrize("names", [("s", "t"), ("u", "v"), ("texture_u", "texture_v")])
def test_texture_coordinates_of_vertices(tmp_path, names):
    extra = "".join(f"property float {name}\n" for name in names)
    head = HEAD + "comment TextureFile the picture.png\n" + POINTS + extra + FACES
    lines = [f"{xyz} {uv}" for xyz, uv in zip(SQUARE, ("0 0", "1 0", "1 1", "0 1"), strict=True)]
    (tmp_path / "a.ply").write_text(text(*lines, *TRIANGLES, head=head))
    Image.new("RGB", (20, 10)).save(tmp_path / "the picture.png")
    mesh = load_scan(tmp_path / "a.ply")
    expected = np.column_stack([mesh.vertices[:, 0] / 9 * 20 - 0.5, (1 - mesh.vertices[:, 1] / 9) * 10 - 0.5])
    np.testing.assert_allclose(mesh.texcoords, expected, atol=EXACT_PX)


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_byte_order_mark_remarks_before_the_format_and_quotes_do_not_matter(tmp_path, mark):
    remarks = 'comment of a scanner\nobj_info one\ncomment TextureFile "the picture.png"\n'
    extra = "property float s\nproperty float t\n"
    lines = [f"{xyz} {uv}" for xyz, uv in zip(SQUARE, ("0 0", "1 0", "1 1", "0 1"), strict=True)]
    data = text(*lines, *TRIANGLES, head=HEAD.replace("format", remarks + "format") + POINTS + extra + FACES)
    (tmp_path / "a.ply").write_bytes(mark + data.encode())
    Image.new("RGB", (20, 10)).save(tmp_path / "the picture.png")
    assert load_scan(tmp_path / "a.ply").texture.shape == (10, 20, 3)
    assert [file.name for file in referenced_files(tmp_path / "a.ply")] == ["the picture.png"]


def test_texture_coordinates_of_faces_split_the_seam(tmp_path):
    head = HEAD + "comment TextureFile a.png\n" + POINTS + FACES + "property list uchar float texcoord\n"
    (tmp_path / "a.ply").write_text(text(*SQUARE, "3 0 1 2 6 0 0 1 0 1 1", "3 0 2 3 6 0.5 0.5 1 1 0 1", head=head))
    Image.new("RGB", (20, 10)).save(tmp_path / "a.png")
    mesh = read_ply(tmp_path / "a.ply")
    at_origin = np.all(mesh.vertices[:, :2] == 0, axis=1)
    assert sorted(map(tuple, mesh.texcoords[at_origin])) == [(-0.5, 9.5), (9.5, 4.5)]


@pytest.mark.parametrize("picture", [True, False])
def test_a_face_without_texture_coordinates_leaves_the_picture_to_the_others(tmp_path, picture):
    comment = "comment TextureFile p.png\n" if picture else ""
    head = HEAD + comment + POINTS + FACES + "property list uchar float texcoord\n"
    (tmp_path / "a.ply").write_text(text(*SQUARE, "3 0 1 2 0", "3 0 2 3 6 0.5 0.5 1 1 0 1", head=head))
    Image.new("RGB", (20, 10)).save(tmp_path / "p.png")
    mesh = read_ply(tmp_path / "a.ply")
    if picture:
        assert mesh.vertices[mesh.faces[0]].tolist() == [[0, 0, -700], [9, 9, -700], [0, 9, -700]]
        np.testing.assert_allclose(mesh.texcoords[mesh.faces[0]], [[9.5, 4.5], [19.5, -0.5], [-0.5, -0.5]])
        assert mesh.findings[0].text.startswith("1 of 2 faces have no texture coordinates and are skipped")
    else:
        assert len(mesh.faces) == 2 and mesh.texcoords is None


def with_colours(mesh, colours):
    """A PLY text of a mesh with a colour for each vertex."""
    rgb = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = (HEAD + POINTS.replace("float", "double") + rgb + FACES).replace("vertex 4", f"vertex {len(mesh.vertices)}")
    points = [f"{x} {y} {z} {r} {g} {b}" for (x, y, z), (r, g, b) in zip(mesh.vertices, colours, strict=True)]
    faces = ["3 {} {} {}".format(*face) for face in mesh.faces]
    return text(*points, *faces, head=head.replace("face 2", f"face {len(mesh.faces)}"))


def test_colours_of_a_shot_become_its_picture(mesh, tmp_path):
    sheet = mesh()
    colours = np.random.default_rng(1).integers(0, 256, (len(sheet.vertices), 3))
    (tmp_path / "a.ply").write_text(with_colours(sheet, colours))
    scan = load_scan(tmp_path / "a.ply")
    assert scan.texture.shape == (12, 16, 3)
    assert scan.texture_xy[3, 5].tolist() == [5, 3]
    order = {tuple(p): c.tolist() for p, c in zip(sheet.vertices, colours, strict=True)}
    seen = scan.measured
    assert [order[tuple(p)] for p in scan.points[seen]] == scan.texture[seen].tolist()


def test_one_colour_of_all_vertices_is_not_a_picture(mesh, tmp_path):
    sheet = mesh()
    moved = SurfaceMesh(sheet.vertices + [60.0, 0, 300], sheet.faces)
    (tmp_path / "a.ply").write_text(with_colours(moved, np.full((len(sheet.vertices), 3), 200)))
    scan = load_scan(tmp_path / "a.ply")
    assert isinstance(scan, SurfaceMesh)
    assert scan.texture is None


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        ("plywood\n", "no PLY header"),
        ("ply\nformat ascii 1.0\n", "no PLY header"),
        (text(*SQUARE), "seems cut short: it promises 6 vertices and faces and ends before"),
        (text(*SQUARE, *TRIANGLES, "3 0 1 3"), "holds more than the 6 vertices and faces"),
        (text(*SQUARE, *TRIANGLES, head=HEAD + POINTS.replace("float z", "float w") + FACES), "no vertices with x, y"),
        (text(*SQUARE, "257" + " 1" * 257, "3 0 2 3"), "has 257 corners, more than 256"),
        (text(*SQUARE, "3 0 1 1.5", "2.5 0 2 3"), "seems cut short"),
        (text(*SQUARE, *TRIANGLES).replace("uchar int", "float int"), "the length of a list is not a whole number"),
        (text(*SQUARE, *TRIANGLES).replace("float y", "quad y"), "a property b'quad y', which cannot be"),
        (text(*SQUARE, *TRIANGLES).replace("float y", "float x"), "a property of vertex is there twice"),
        (text(*SQUARE, *TRIANGLES).replace("element face", "element vertex"), "an element twice"),
        (text(*SQUARE, *TRIANGLES).replace("comment made", "hello"), "a line b'hello by hand'"),
        (text(*SQUARE, "3 0 1 9", "3 0 2 3"), "uses vertex 9 of 4"),
        (text(*SQUARE, "3 0 1 -1", "3 0 2 3"), "a face uses vertex"),
        (text("nan 0 0", *SQUARE[1:], *TRIANGLES), "vertex 0 lies at"),
        (text("zero 0 0", *SQUARE[1:], *TRIANGLES), "the body holds b'zero', which is not a number"),
        (text(*SQUARE, head=HEAD + POINTS), "4 points, which are not a surface"),
        (text(*SQUARE, *TRIANGLES).replace("vertex 4", "vertex 4000000000"), "promises 4000000002"),
    ],
)
def test_damage_is_named(tmp_path, content, fault):
    (tmp_path / "bad.ply").write_text(content)
    with pytest.raises(BadInput, match=f"bad.ply.*{fault}"):
        load_scan(tmp_path / "bad.ply")


@pytest.mark.parametrize(
    ("name", "fault"), [("gone.png", "its image 'gone.png' is missing"), ("../gone/b.png", "outside")]
)
def test_a_picture_that_cannot_be_had_is_named(mesh, tmp_path, name, fault):
    write_ply(mesh(), tmp_path / "a.ply")
    data = (tmp_path / "a.ply").read_bytes().replace(b"TextureFile a.png", b"TextureFile " + name.encode())
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(BadInput, match=fault):
        load_scan(tmp_path / "a.ply")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
@pytest.mark.parametrize("kind", ["text", "binary"])
def test_a_cut_file_is_reported(mesh, tmp_path, kind, share):
    path = tmp_path / "cut.ply"
    if kind == "text":
        path.write_text(with_colours(mesh(), np.zeros((len(mesh().vertices), 3), int)))
    else:
        write_ply(mesh(), path)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(BadInput, match=r"cut\.ply seems cut short"):
        load_scan(path)


def range_grid(scan, *, upwards):
    """A shot as the Stanford scanning repository writes it, its rows downwards or upwards."""
    measured, points = scan.measured, scan.points
    if upwards:
        measured, points = measured[::-1], points[::-1]
    rows, cols = measured.shape
    number = (np.cumsum(measured) - 1).reshape(measured.shape)
    cells = [f"1 {number[at]}" if measured[at] else "0" for at in np.ndindex(rows, cols)]
    head = f"ply\nformat ascii 1.0\nobj_info num_cols {cols}\nobj_info num_rows {rows}\n" + POINTS.replace(
        "vertex 4", f"vertex {measured.sum()}"
    ).replace("float", "double")
    grid = f"element range_grid {rows * cols}\nproperty list uchar int vertex_indices\n"
    return text(*("{!r} {!r} {!r}".format(*p) for p in points[measured].tolist()), *cells, head=head + grid)


@pytest.mark.parametrize("upwards", [False, True])
def test_a_range_grid_is_the_mesh_of_its_samples(shot, mesh, tmp_path, upwards):
    (tmp_path / "a.ply").write_text(range_grid(shot(), upwards=upwards))
    back, sheet = read_ply(tmp_path / "a.ply"), mesh()
    assert len(back.faces) == len(sheet.faces)
    a, b, c = (back.vertices[back.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()  # all face the scanner
    assert {tuple(v) for v in back.vertices} == {tuple(v) for v in sheet.vertices[np.unique(sheet.faces)]}


@pytest.mark.parametrize(("word", "other"), [("num_cols 16", "num_cols 15"), ("num_rows 12", "num_rows x")])
def test_a_range_grid_of_another_size_is_refused(shot, tmp_path, word, other):
    (tmp_path / "a.ply").write_text(range_grid(shot(), upwards=False).replace(word, other))
    with pytest.raises(BadInput, match=r"a\.ply.*range grid"):
        load_scan(tmp_path / "a.ply")

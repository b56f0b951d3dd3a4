"""Wavefront text."""

import tracemalloc
from pathlib import Path
from time import process_time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan, write_obj
from restore.formats.obj import read_obj
from restore.formats.obj_text import parse_obj
from restore.formats.references import referenced_files
from restore.scan import RangeScan

SIZE = 200_000  # bytes: a parser that looks back over all of them takes seconds
NOISE, TICK = 3.0, 1e-3  # a quadratic parser takes 16 times as long; shorter times than a tick are all alike
HALF_DIGIT_MM = 0.51e-4  # four decimals
HALF_DIGIT_PX = 0.51e-7 * 640  # seven decimals of the picture's width

SQUARE = "v 0 0 -700\nv 9 0 -700\nv 9 9 -700\nv 0 9 -700\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt 0.5 0.5\n"
MATERIAL = "newmtl other\nmap_Kd missing.png\nnewmtl page\nmap_Kd picture.png\n"
FACE = "f 1/1 2/2 3/3\n"


@pytest.fixture
def written(tmp_path):
    """Write an OBJ text, its material and its picture of 20 × 10 pixels; returns the path."""

    def write(text, material=MATERIAL):
        (tmp_path / "a.obj").write_text(text)
        (tmp_path / "a.mtl").write_text(material)
        Image.new("RGB", (20, 10), (1, 2, 3)).save(tmp_path / "picture.png")
        return tmp_path / "a.obj"

    return write


@pytest.mark.parametrize("first", [b"", b"# of another program\n", b"# of another program\r\n"])
def test_lines_may_end_with_carriage_returns_alone(written, first):
    path = written("mtllib a.mtl\nusemtl page\n" + SQUARE + FACE + "f 1/1 3/3 4/4\n")
    expected = load_scan(path)
    for file in (path, path.with_suffix(".mtl")):
        file.write_bytes(first + file.read_bytes().replace(b"\n", b"\r"))
    found = load_scan(path)
    np.testing.assert_array_equal(found.vertices, expected.vertices)
    np.testing.assert_array_equal(found.texcoords, expected.texcoords)
    np.testing.assert_array_equal(found.texture, expected.texture)
    assert {file.name for file in referenced_files(path)} == {"a.mtl", "picture.png"}


def test_a_mesh_comes_back_on_its_grid(mesh, shot, tmp_path):
    write_obj(mesh(rows=24, cols=32), tmp_path / "page.obj")
    back, scan = load_scan(tmp_path / "page.obj"), shot(24, 32)
    assert isinstance(back, RangeScan)
    seen = back.measured
    np.testing.assert_allclose(back.points[seen], scan.points[seen], atol=HALF_DIGIT_MM, rtol=0)
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=HALF_DIGIT_PX, rtol=0)
    np.testing.assert_array_equal(back.texture, scan.texture)


def test_a_texture_coordinate_counts_from_the_lower_left(written):
    mesh = load_scan(written("mtllib a.mtl\nusemtl page\n" + SQUARE + FACE))
    assert mesh.texcoords.tolist() == [[-0.5, 9.5], [19.5, 9.5], [19.5, -0.5]]
    assert mesh.texture.shape == (10, 20, 3)


@pytest.mark.parametrize(
    "name, coding", [("bild ü.png", "latin-1"), ("bild ü.png", "utf-8"), ('"picture.png"', "utf-8"), ("b.png", "utf-8")]
)
def test_pictures_are_found_by_names_as_editors_write_them(written, name, coding):
    """In Latin-1, quoted, and beside a material file in a folder of its own."""
    path = written('mtllib "tex/a.mtl"\nusemtl page\n' + SQUARE + FACE)
    (path.parent / "tex").mkdir()
    (path.parent / "tex" / "a.mtl").write_bytes(f"newmtl page\nmap_Kd {name}\n".encode(coding))
    (path.parent / "picture.png").rename(path.parent / "tex" / name.strip('"'))
    assert load_scan(path).texture.shape == (10, 20, 3)


def test_a_vertex_on_a_seam_is_split_and_unused_ones_are_left_out(written):
    mesh = read_obj(written("mtllib a.mtl\nusemtl page\n" + SQUARE + FACE + "f 1/5 2/2 3/3\n"))
    assert len(mesh.vertices) == len(mesh.texcoords) == 4
    assert {tuple(t) for t in mesh.texcoords[np.all(mesh.vertices[:, :2] == 0, axis=1)]} == {(-0.5, 9.5), (9.5, 4.5)}


def test_quads_and_triangles_together(written):
    mesh = read_obj(written("mtllib a.mtl\nusemtl page\n" + SQUARE + "f 1/1 2/2 3/3 4/4\n" + FACE))
    assert len(mesh.faces) == 3
    area = np.cross(*(mesh.vertices[mesh.faces[:, k]] - mesh.vertices[mesh.faces[:, 0]] for k in (1, 2)))[:, 2] / 2
    assert area.tolist() == [40.5] * 3
    u = (mesh.texcoords[:, 0] + 0.5) / 20
    assert u.tolist() == (mesh.vertices[:, 0] / 9).tolist()


@pytest.mark.parametrize(
    "name",
    ["./picture.png", ".\\picture.png", "-s 1 1 1 picture.png", "-clamp on picture.png", "-o 0 0 -s 1.0 picture.png"],
)
def test_ways_to_name_the_picture(written, name):
    text = "mtllib a.mtl\r\nusemtl page\r\n" + SQUARE + FACE
    assert load_scan(written(text, f"newmtl page\r\nmap_Kd {name}\r\n")).texture.shape == (10, 20, 3)


@pytest.mark.parametrize(
    ("head", "material", "fault"),
    [
        ("mtllib a.mtl\nusemtl other\n", MATERIAL, "its image 'missing.png' is missing"),
        ("mtllib ../gone.mtl\n", MATERIAL, r"'\.\./gone\.mtl' outside its own folder"),
        ("mtllib /etc/passwd\n", MATERIAL, "'/etc/passwd' outside its own folder"),
        ("mtllib a.mtl\n", "newmtl page\nmap_Kd C:\\scans\\page.png\n", "outside its own folder"),
        ("mtllib a.mtl\n", "newmtl page\nmap_Kd a.mtl\n", "not a readable image"),
    ],
)
def test_a_picture_that_cannot_be_had_is_named_unless_another_is_given(written, tmp_path, head, material, fault):
    path = written(head + SQUARE + FACE, material)
    with pytest.raises(BadInput, match=f"a.*{fault}"):
        load_scan(path)
    assert load_scan(path, tmp_path / "picture.png").texture.shape == (10, 20, 3)


@pytest.mark.parametrize("key", ["map_kd", "MAP_KD"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_a_byte_order_mark_and_the_case_of_a_keyword_do_not_matter(written, key, mark):
    path = written(
        "v 7 7 -700\n" + SQUARE + "mtllib a.mtl\nusemtl page\nf 2/1 3/2 4/3\n", f"newmtl page\n{key} picture.png\n"
    )
    for file in (path, path.with_suffix(".mtl")):
        file.write_bytes(mark + file.read_bytes())
    mesh = load_scan(path)
    assert mesh.vertices.tolist() == [[0, 0, -700], [9, 0, -700], [9, 9, -700]]
    assert mesh.texture.shape == (10, 20, 3)
    path.write_bytes(mark + b"mtllib a.mtl\n" + SQUARE.encode() + FACE.encode())
    assert {file.name for file in referenced_files(path)} == {"a.mtl", "picture.png"}


@pytest.mark.parametrize("options", ["-s 1 -1 1", "-s 2", "-clamp on -o 0.5 0 0", "-o 0 .1"])
def test_options_that_move_the_picture_are_refused(written, options):
    text = "mtllib a.mtl\nusemtl page\n" + SQUARE + FACE
    with pytest.raises(BadInput, match=r"a\.obj: the option -[so] .* moves its image"):
        load_scan(written(text, f"newmtl page\nmap_Kd {options} picture.png\n"))
    assert (
        load_scan(written(text, f"newmtl page\nmap_Kd picture.png\nnewmtl b\nmap_Kd {options} b.png\n")).texture
        is not None
    )


@pytest.mark.parametrize(
    "value, fault",
    [
        ("nan", r"\(nan, 0\) of the vertex at \(9, 0, -700\) mm is not a number"),
        ("-inf", r"\(-inf, 0\) .* is not a number"),
        ("1e4", r"\(10000, 0\) of the vertex at \(9, 0, -700\) mm lies far outside the image"),
    ],
)
def test_a_texture_coordinate_that_cannot_be_is_named_with_its_vertex(written, value, fault):
    with pytest.raises(BadInput, match=rf"a\.obj: the texture coordinate {fault}"):
        load_scan(written("mtllib a.mtl\nusemtl page\n" + SQUARE.replace("vt 1 0", f"vt {value} 0") + FACE))


def test_a_link_out_of_the_folder_is_not_followed(written, tmp_path):
    secret = tmp_path / "secret.png"
    Image.new("RGB", (4, 3)).save(secret)
    (tmp_path / "scan").mkdir()
    (tmp_path / "scan" / "page.png").symlink_to(secret)
    (tmp_path / "scan" / "a.mtl").write_text("newmtl page\nmap_Kd page.png\n")
    (tmp_path / "scan" / "a.obj").write_text("mtllib a.mtl\n" + SQUARE + FACE)
    with pytest.raises(BadInput, match="outside its own folder"):
        load_scan(tmp_path / "scan" / "a.obj")


def test_the_material_of_a_mesh_without_texture_coordinates_is_of_no_interest(written):
    assert load_scan(written("mtllib gone.mtl\n" + SQUARE + "f 1 2 3\n")).texture is None


def test_faces_without_texture_coordinates_are_left_out_and_the_picture_stays(written):
    """As MeshLab fills holes."""
    path = written("mtllib a.mtl\nusemtl page\n" + SQUARE + FACE + "f 1/1 2/2 4/4\nf 1/1 3/3 4\n")
    mesh = load_scan(path)
    assert mesh.texture.shape == (10, 20, 3) and mesh.faces.shape == (2, 3)
    assert mesh.findings[0].text.startswith("1 of 3 faces have no texture coordinates and are skipped")


def test_where_most_faces_have_no_texture_coordinates_the_surface_stays(written):
    mesh = load_scan(written("mtllib a.mtl\nusemtl page\n" + SQUARE + FACE + "f 1 3 4\nf 1 2 4\n"))
    assert mesh.texcoords is None and len(mesh.faces) == 3
    assert (
        "2 of 3 faces have no texture coordinates: the image is not used. Export the mesh with all texture coordinates"
        in [one.text for one in mesh.findings]
    )


def test_without_a_picture_no_face_is_left_out(written):
    mesh = load_scan(written(SQUARE + FACE + "f 1/1 2/2 4/4\nf 1 3 4\n"))
    assert len(mesh.faces) == 3 and not mesh.findings


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("hello\n", "no triangle"),
        (SQUARE, "no triangle"),
        (SQUARE + "f 1 2 99\n", "out of bounds"),
        (SQUARE + "f 1 2 -99\n", "out of bounds"),
        (SQUARE.replace("9", "nine", 1) + FACE, "b'nine', which is not a number"),
        (SQUARE.replace("9", "eight", 1) + FACE, "line 2: a word stands where a number should be"),
        (SQUARE + "f 1 2 x\n", "line 10: a corner of the face is not of the form"),
        (SQUARE + "f" + " 1" * 1_000_000 + "\n", "more than 256 corners"),
        (SQUARE.replace("9", "inf", 1) + FACE, r"at \(inf, 0, -700\) mm"),
        (SQUARE.replace("9", "1e9", 1) + FACE, r"at \(1e\+09, 0, -700\) mm"),
        (SQUARE + "f 1/1 2/2\n", "no triangle"),
    ],
)
def test_damage_is_named(written, text, fault):
    with pytest.raises(BadInput, match=f"a.obj.*{fault}"):
        load_scan(written(text))


@settings(deadline=None, max_examples=30)
@given(
    order=st.permutations(range(4)),
    faces=st.lists(st.permutations(range(4)).map(lambda p: p[:3]), min_size=1, max_size=6),
)
def test_every_triangle_keeps_its_place(order, faces, tmp_path_factory):
    corners = np.array([[0, 0, -700], [9, 0, -701], [9, 9, -702], [0, 9, -703.25]])[order]
    text = "".join("v {} {} {}\n".format(*v) for v in corners) + "".join(
        "f {} {} {}\n".format(*(np.add(f, 1))) for f in faces
    )
    path = tmp_path_factory.mktemp("obj") / "a.obj"
    path.write_text(text)
    mesh = read_obj(path)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], corners[np.array(faces)])


@settings(deadline=None, max_examples=300)
@given(st.floats(-9e4, 9e4), st.sampled_from(["r", ".17e", ".4f", ".12f", "+.6g", ".30f"]))
def test_every_number_is_the_one_that_python_reads(value, form):
    text = repr(value) if form == "r" else format(value, form)
    parsed = parse_obj(Path("a.obj"), f"v {text} 0 0\n".encode())
    assert parsed.vertices[0, 0] == float(text)


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=60))
def test_any_bytes_give_arrays_that_fit_or_one_error(data):
    try:
        text = parse_obj(Path("a.obj"), b"v 0 0 0\nvt 0 0\n" + data)
    except BadInput:
        return
    assert text.sizes.sum() == len(text.corners) == len(text.uvs)
    assert not len(text.corners) or 0 <= text.corners.min() <= text.corners.max() < len(text.vertices)
    assert not len(text.uvs) or text.uvs.max() < len(text.uv)


def test_a_last_face_that_is_cut_is_reported(written):
    with pytest.raises(BadInput, match="seems cut short: its last face is not complete"):
        load_scan(written(SQUARE + FACE + "f 1/1 4/4"))
    assert len(load_scan(written(SQUARE + FACE + "f 1/1 3/3 4/4")).faces) == 2  # some writers leave out the last end


LINEAR = {
    "blanks behind usemtl": lambda size: b"usemtl" + b" " * size,
    "blanks before nothing": lambda size: b" " * size,
    "materials": lambda size: b"usemtl a\n" * (size // 9),
    "objects": lambda size: b"o a\n" * (size // 4),
    "libraries": lambda size: b"mtllib a.mtl\n" * (size // 13),
    "empty lines": lambda size: b"\n" * size,
    "long numbers": lambda size: b"v 0.12345678901234567 1e-300 7\n" * (size // 31),
}


@pytest.mark.parametrize("name", LINEAR)
def test_four_times_the_file_takes_no_more_than_four_times_as_long(name):
    def seconds(size):
        data = SQUARE.encode() + LINEAR[name](size)
        taken = []
        for _ in range(5):
            start = process_time()
            parse_obj(Path("a.obj"), data)
            taken.append(process_time() - start)
        return min(taken)

    seconds(100)  # the compiler's time is not the parser's
    assert seconds(4 * SIZE) < 4 * NOISE * max(seconds(SIZE), TICK)


MEMORY_RATIO, MEMORY_BYTES = 12, 200 * 10**6  # of the file, and on top of that
# A line that makes the most of its bytes, and the size of the file: as large as its limits on faces let it be.
GREEDY = {
    "triangles": (b"f 1 2 3\n", 25_000_000),
    "polygons": (b"f" + b" 1 2 3" * 80 + b"\n", 6_300_000),
    "vertices": (b"v 0 0 -700\n", 25_000_000),
    "coloured vertices": (b"v 0 0 -700 1 1 1\n", 25_000_000),
    "long numbers": (b"v 1e0 1e0 1e0\n", 25_000_000),
    "texture coordinates": (b"vt 0\n", 25_000_000),
    "materials": (b"usemtl a\n", 2_000_000),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", GREEDY)
def test_memory_is_bounded_by_the_size_of_the_file(name, tmp_path):
    line, size = GREEDY[name]
    data = b"v 0 0 -700\nv 9 0 -700\nv 9 9 -700\n" + line * (size // len(line)) + b"f -1 -2 -3\nf 1 2 3\n"
    (tmp_path / "a.obj").write_bytes(data)
    tracemalloc.start()
    try:
        read_obj(tmp_path / "a.obj")
        assert tracemalloc.get_traced_memory()[1] < MEMORY_RATIO * len(data) + MEMORY_BYTES
    finally:
        tracemalloc.stop()


def test_a_thousand_names_of_materials_are_too_many(written):
    names = "".join(f"usemtl {k}\n" for k in range(1001))
    with pytest.raises(BadInput, match=r"a\.obj names more than 1000 materials"):
        load_scan(written(names + SQUARE + FACE))


def test_a_name_of_a_file_of_any_length_is_refused_in_one_line(written):
    with pytest.raises(BadInput, match=r"a\.obj refers to a file by a name of 100000 characters"):
        load_scan(written("mtllib " + "a" * 100_000 + "\n" + SQUARE + FACE))


def test_a_file_that_was_cut_is_not_read_as_a_smaller_page(mesh, tmp_path):
    write_obj(mesh(rows=48, cols=64), tmp_path / "a.obj")
    whole = (tmp_path / "a.obj").read_bytes()
    cut = tmp_path / "cut.obj"
    (tmp_path / "cut.png").write_bytes((tmp_path / "a.png").read_bytes())
    for share in (0.3, 0.6, 0.8, 0.9):
        data = whole[: int(share * len(whole))]
        cut.write_bytes(data.rstrip(b"\n"))
        with pytest.raises(BadInput, match=r"cut\.obj (seems cut short|holds no surface)"):
            read_obj(cut)


def test_a_file_that_was_cut_between_two_lines_is_refused_or_warned_of(mesh, tmp_path):
    """Faces that were deleted in an editor leave the same: most of the page is kept, with a warning."""
    write_obj(mesh(rows=48, cols=64, missing=0.0), tmp_path / "a.obj")
    lines = (tmp_path / "a.obj").read_bytes().splitlines(keepends=True)
    last = sum(line.startswith(b"f ") for line in lines)
    for share in (0.2, 0.4):
        (tmp_path / "a.obj").write_bytes(b"".join(lines[: len(lines) - last + int(share * last)]))
        with pytest.raises(BadInput, match=r"a\.obj seems cut short"):
            read_obj(tmp_path / "a.obj")
    for share in (0.6, 0.95):
        (tmp_path / "a.obj").write_bytes(b"".join(lines[: len(lines) - last + int(share * last)]))
        assert "the file is cut short" in load_scan(tmp_path / "a.obj").findings[0].text

"""Ordered point sets of Volume Cartographer."""

import numpy as np
import pytest

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.segment import MAX_SEGMENT_POINTS
from restore.mesh.ordered_grid import GridMesh

# As its own software writes it: a header of text, then doubles, row by row.
HEADER = "width: {cols}\nheight: {rows}\ndim: {dim}\nordered: true\ntype: {kind}\nversion: 1\n<>\n"
POINTS = np.array([[[16, 6.5, 1], [18, 6.5, 1], [20, 6.5, 1.25]], [[16, 6.5, 3], [18, 7, 3], [20, 7.5, 3]]])
UM = 1e-3  # mm


def written(path, points=POINTS, kind="double", body=None, **fields):
    rows, cols, dim = points.shape
    header = HEADER.format(**{"rows": rows, "cols": cols, "dim": dim, "kind": kind} | fields)
    types = {"float": "<f4", "double": "<f8", "int": "<i4"}
    path.write_bytes(header.encode() + (points.astype(types.get(kind, "<f8")).tobytes() if body is None else body))
    return path


@pytest.mark.parametrize("kind", ["double", "float"])
def test_points_come_back_in_the_order_of_the_grid_in_millimetres(tmp_path, kind):
    mesh = load_scan(written(tmp_path / "a.vcps", kind=kind), unit="7.5um")
    assert isinstance(mesh, GridMesh)
    np.testing.assert_allclose(mesh.vertices, POINTS.reshape(-1, 3) * 7.5 * UM)
    assert (mesh.shape, mesh.places.tolist(), len(mesh.faces)) == ((2, 3), [0, 1, 2, 3, 4, 5], 4)
    assert mesh.provenance["unit"] == "7.5um"


def test_integers_text_comments_and_normals_are_read(tmp_path):
    whole = np.round(POINTS)
    first = load_scan(written(tmp_path / "a.vcps", whole, "int"), unit="mm")
    lines = "\n".join(" ".join(map(str, point)) for point in whole.reshape(-1, 3))
    second = load_scan(written(tmp_path / "b.vcps", whole, body=lines.encode()), unit="mm")
    with_normals = np.concatenate([whole, np.ones_like(whole)], axis=2)
    third = load_scan(written(tmp_path / "c.vcps", with_normals), unit="mm")
    fourth = tmp_path / "d.vcps"
    fourth.write_bytes(b"# made by hand\r\n" + (tmp_path / "a.vcps").read_bytes())
    for mesh in (first, second, third, load_scan(fourth, unit="mm")):
        np.testing.assert_array_equal(mesh.vertices, whole.reshape(-1, 3))


@pytest.mark.parametrize("absent", [-1.0, 0.0, np.nan, np.inf])
def test_points_without_a_position_leave_a_hole(tmp_path, absent):
    points = POINTS.copy()
    points[0, 1] = absent
    mesh = load_scan(written(tmp_path / "a.vcps", points), unit="mm")
    assert mesh.places.tolist() == [0, 2, 3, 4, 5]
    assert np.isfinite(mesh.vertices).all()
    assert len(mesh.faces) == 2


def test_without_the_size_of_a_voxel_one_is_assumed_with_a_warning(tmp_path):
    mesh = load_scan(written(tmp_path / "a.vcps"))
    np.testing.assert_allclose(mesh.vertices, POINTS.reshape(-1, 3) * 10 * UM)
    assert "size of a voxel" in mesh.findings[0].text
    assert "--unit" in mesh.findings[0].text


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"kind": "quad"}, "type 'quad'"),
        ({"rows": 1}, "not a surface"),
        ({"cols": 30}, "cut short"),
        ({"rows": MAX_SEGMENT_POINTS}, "more than"),
        ({"rows": 10**12}, "height"),
        ({"cols": "x"}, "width"),
        ({"dim": 2}, "2 numbers each"),
        ({"dim": 10}, "10 numbers each"),
    ],
)
def test_headers_that_cannot_be_are_refused(tmp_path, fields, message):
    path = written(tmp_path / "a.vcps", **fields)
    with pytest.raises(BadInput, match=message) as caught:
        load_scan(path)
    assert caught.value.hint


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        (b"ordered: true", b"ordered: false", "without an order"),
        (b"version: 1", b"version: 2", "version '2'"),
        (b"<>", b"", "does not end"),
    ],
)
def test_other_kinds_of_point_sets_are_refused(tmp_path, before, after, message):
    path = written(tmp_path / "a.vcps")
    path.write_bytes(path.read_bytes().replace(before, after))
    with pytest.raises(BadInput, match=message):
        load_scan(path)


def test_bodies_of_the_wrong_size_are_refused(tmp_path):
    with pytest.raises(BadInput, match="cut short"):
        load_scan(written(tmp_path / "a.vcps", body=POINTS.astype("<f8").tobytes()[:-1]))
    with pytest.raises(BadInput, match="145 bytes"):
        load_scan(written(tmp_path / "b.vcps", body=POINTS.astype("<f8").tobytes() + b"\xff"))
    with pytest.raises(BadInput, match="17 numbers"):
        load_scan(written(tmp_path / "c.vcps", body=b"1 " * 17))


def test_a_grid_without_a_cell_is_refused(tmp_path):
    with pytest.raises(BadInput, match="no surface"):
        load_scan(written(tmp_path / "a.vcps", np.full((3, 4, 3), -1.0)))

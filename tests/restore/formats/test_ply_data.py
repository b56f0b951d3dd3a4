"""The parser of polygon files."""

from contextlib import suppress
from pathlib import Path
from time import process_time

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.errors import BadInput
from restore.formats.ply_data import parse_ply

HEAD = b"ply\nformat %s 1.0\ncomment one\nobj_info two\nelement vertex %d\nproperty float x\nproperty short y\n"
LISTS = b"element face %d\nproperty uchar k\nproperty list ushort int corners\nproperty list uchar double uv\n"
END = b"end_header\n"
SIZE = 200_000  # bytes of a file
NOISE, TICK = 3.0, 1e-3  # a quadratic parser takes 16 times as long; shorter times than a tick are all alike

numbers = st.integers(-(2**15), 2**15 - 1)
polygons = st.lists(
    st.tuples(
        st.integers(0, 255), st.lists(st.integers(-(2**31), 2**31 - 1), max_size=4), st.lists(numbers, max_size=3)
    ),
    max_size=5,
)


def parse(data):
    return parse_ply(Path("a.ply"), data)


def encoded(encoding, vertices, faces):
    """A file with a point (x, y) for each vertex and two lists for each face."""
    head = HEAD % (encoding, len(vertices)) + LISTS % len(faces) + END
    if encoding == b"ascii":
        lines = [b"%d %d" % vertex for vertex in vertices]
        lines += [b" ".join(b"%d" % n for n in (k, len(corners), *corners, len(uv), *uv)) for k, corners, uv in faces]
        return head + b"\n".join(lines) + b"\n"
    order = "<" if b"little" in encoding else ">"
    body = b"".join(np.array(x, order + "f4").tobytes() + np.array(y, order + "i2").tobytes() for x, y in vertices)
    for k, corners, uv in faces:
        body += bytes([k]) + np.array(len(corners), order + "u2").tobytes() + np.array(corners, order + "i4").tobytes()
        body += bytes([len(uv)]) + np.array(uv, order + "f8").tobytes()
    return head + body


@settings(deadline=None, max_examples=60)
@given(
    st.sampled_from([b"ascii", b"binary_little_endian", b"binary_big_endian"]),
    st.lists(st.tuples(numbers, numbers), max_size=5),
    polygons,
)
def test_every_number_comes_back_in_every_encoding(encoding, vertices, faces):
    content = parse(encoded(encoding, vertices, faces))
    assert content.header.comments == (b"one",)
    assert content.header.notes == (b"two",)
    columns = [content.columns["vertex"][name].tolist() for name in "xy"]
    assert list(zip(*columns, strict=True)) == vertices
    for place, name in ((1, "corners"), (2, "uv")):
        lists = content.lists["face"][name]
        found = [lists.values[at : at + n].tolist() for at, n in zip(lists.starts, lists.sizes, strict=True)]
        assert found == [face[place] for face in faces]


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=80), st.sampled_from([b"ascii", b"binary_little_endian", b"binary_big_endian"]))
def test_any_bytes_give_arrays_that_fit_or_one_error(data, encoding):
    try:
        content = parse(HEAD % (encoding, 2) + LISTS % 2 + END + data)
    except BadInput:
        return
    for lists in content.lists["face"].values():
        assert lists.sizes.min() >= 0
        assert lists.sizes.sum() == len(lists.values)


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=80))
def test_any_header_is_read_or_refused(data):
    try:
        parse(b"ply\nformat ascii 1.0\n" + data + b"\nend_header\n")
    except BadInput as error:
        assert "a.ply" in str(error)


def test_the_mesh_is_that_of_another_reader():
    sphere = trimesh.creation.icosphere(3)
    for encoding in ("ascii", "binary_little_endian"):
        content = parse(trimesh.exchange.ply.export_ply(sphere, encoding=encoding))
        corners = content.lists["face"]["vertex_indices"]
        assert (corners.sizes == 3).all()
        np.testing.assert_array_equal(corners.values.reshape(-1, 3), sphere.faces)
        points = np.column_stack([content.columns["vertex"][axis] for axis in "xyz"])
        np.testing.assert_array_equal(points.astype(np.float32), sphere.vertices.astype(np.float32))


LINEAR = {
    "a header of comments": lambda size: b"ply\nformat ascii 1.0\n" + b"comment a\n" * (size // 10) + END,
    "a header without an end": lambda size: b"ply\nformat ascii 1.0\n" + b"\n" * size,
    "blanks": lambda size: HEAD % (b"ascii", 0) + END + b" " * size,
    "empty lists": lambda size: HEAD % (b"ascii", 0) + LISTS % (size // 6) + END + b"1 0 0\n" * (size // 6),
    "a long number": lambda size: HEAD % (b"ascii", 1) + END + b"0 " + b"1" * size,
    "a word at the end": lambda size: HEAD % (b"ascii", 1) + END + b"0 " * (size // 2) + b"x",
}


@pytest.mark.parametrize("name", LINEAR)
def test_four_times_the_file_takes_no_more_than_four_times_as_long(name):
    def seconds(size):
        data, taken = LINEAR[name](size), []
        for _ in range(3):
            start = process_time()
            with suppress(BadInput):
                parse(data)
            taken.append(process_time() - start)
        return min(taken)

    seconds(100)  # the compiler's time is not the parser's
    assert seconds(4 * SIZE) < 4 * NOISE * max(seconds(SIZE), TICK)

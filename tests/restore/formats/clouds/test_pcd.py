"""PCD files of the Point Cloud Library in all three encodings."""

import numpy as np
import pytest

from oracles.clouds import CAMERA, compress, write_pcd
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.pcd import _expand, read_pcd
from restore.scan import RangeScan
from tests.restore.formats.clouds.test_organised import POSED_MM, TURNED

ENCODINGS = ("ascii", "binary", "binary_compressed")


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_organised_cloud_comes_back_with_its_colours(tmp_path, sheet, same_as, encoding):
    write_pcd(tmp_path / "a.pcd", sheet, encoding)
    same_as(load_scan(tmp_path / "a.pcd"), sheet)


def test_points_in_another_frame_are_seen_from_the_viewpoint(tmp_path, sheet, same_as):
    posed = RangeScan((sheet.points * CAMERA) @ TURNED.T + [300.0, -200.0, 50.0], sheet.texture, sheet.texture_xy)
    w = np.sqrt(1.0 + np.trace(TURNED)) / 2.0
    x, y, z = (TURNED[a, b] - TURNED[b, a] for a, b in ((2, 1), (0, 2), (1, 0)))
    pose = f"300 -200 50 {w} {x / (4 * w)} {y / (4 * w)} {z / (4 * w)}"
    write_pcd(tmp_path / "a.pcd", posed, axes=np.ones(3), pose=pose)
    same_as(load_scan(tmp_path / "a.pcd"), sheet, within=POSED_MM)


@pytest.mark.parametrize("kind", ["U", "F"])
def test_colours_of_text_are_whole_numbers_or_floats(tmp_path, kind):
    number = 0x00FF8001 if kind == "U" else np.array(0x00FF8001, np.uint32).view(np.float32)
    header = f"VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F {kind}\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    (tmp_path / "a.pcd").write_text(f"{header}DATA ascii\n1 2 3 {number!s}\n2 3 4 0\n")
    assert read_pcd(tmp_path / "a.pcd").colours.tolist() == [[255, 128, 1], [0, 0, 0]]


def test_fields_of_several_numbers_and_padding_are_passed_over(tmp_path):
    header = (
        "VERSION 0.7\nFIELDS x _ y z _ f\nSIZE 4 1 8 4 1 4\nTYPE F U F F U F\nCOUNT 1 3 1 1 2 5\nWIDTH 2\nHEIGHT 1\n"
    )
    record = np.dtype([("x", "<f4"), ("a", "u1", 3), ("y", "<f8"), ("z", "<f4"), ("b", "u1", 2), ("f", "<f4", 5)])
    table = np.zeros(2, record)
    table["x"], table["y"], table["z"] = [1, 2], [3, 4], [5, 6]
    (tmp_path / "a.pcd").write_bytes(f"{header}POINTS 2\nDATA binary\n".encode() + table.tobytes())
    assert read_pcd(tmp_path / "a.pcd").points.tolist() == [[1, 3, 5], [2, 4, 6]]


def test_compression_reverses_for_runs_of_every_length():
    rng = np.random.default_rng(0)
    for size in (1, 31, 32, 33, 264, 265, 5000):
        for values in (1, 2, 256):
            data = rng.integers(0, values, size).astype(np.uint8)
            out = np.empty(size, np.uint8)
            assert _expand(np.frombuffer(compress(data.tobytes()), np.uint8), out) == size
            np.testing.assert_array_equal(out, data)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        (b"WIDTH 32", b"WIDTH 99999999", "more than"),
        (b"WIDTH 32", b"WIDTH 0", "header cannot be"),
        (b"HEIGHT 24", b"HEIGHT 25", "cut short"),
        (b"SIZE 4 4 4 4", b"SIZE 4 4 4 3", "header cannot be"),
        (b"COUNT 1 1 1 1", b"COUNT 1 1 1 999999999", "cut short|header cannot be"),
        (b"FIELDS x y z rgb", b"FIELDS x y w rgb", "no fields x, y and z"),
        (b"DATA binary", b"DATA banana", "of the kind"),
    ],
)
def test_what_a_header_cannot_say_is_refused(tmp_path, sheet, old, new, fault):
    write_pcd(tmp_path / "a.pcd", sheet)
    data = (tmp_path / "a.pcd").read_bytes()
    (tmp_path / "a.pcd").write_bytes(data.replace(old, new, 1))
    with pytest.raises(BadInput, match=fault):
        load_scan(tmp_path / "a.pcd")

"""Element files of the scanner's own software."""

import struct

import numpy as np
import pytest

from restore.errors import BadInput
from restore.formats import load_scan, write_vvd

PLACE_PX = 1e-6  # the coordinates are exact, the lattice is fitted to them


def test_a_scan_comes_back_exactly(shot, tmp_path):
    scan = shot(24, 32)
    write_vvd(scan, tmp_path / "page.vvd")
    back = load_scan(tmp_path / "page.vvd")
    seen = back.measured
    np.testing.assert_array_equal(back.points[seen], scan.points[seen])
    assert seen.sum() > 0.95 * scan.measured.sum()  # a sample without any neighbour belongs to no face
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=PLACE_PX, rtol=0)


def test_the_layout(shot, tmp_path):
    scan = shot(2, 2, missing=0)
    write_vvd(scan, tmp_path / "a.vvd")
    data = (tmp_path / "a.vvd").read_bytes()
    assert data[:5] == b"VIVID"
    assert struct.unpack_from(">i", data, 132) == (4,)
    assert struct.unpack_from(">3d", data, 136) == tuple(scan.points[0, 0])
    assert struct.unpack_from(">6i", data, 136 + 4 * 24) == (1, 4, 0, 2, 3, 1)


def test_what_follows_the_faces_is_left_out(shot, tmp_path):
    write_vvd(shot(), tmp_path / "a.vvd")
    with (tmp_path / "a.vvd").open("ab") as file:
        file.write(b"a picture, perhaps")
    assert load_scan(tmp_path / "a.vvd").measured.any()


@pytest.mark.parametrize(
    ("offset", "word", "fault"),
    [
        (0, -1, "must begin with VIVID"),
        (132, 0, "claims 0 vertices"),
        (132, -5, "claims -5 vertices"),
        (132, 2**31 - 1, "seems cut short: it claims 2147483647 vertices"),
        (136 + 96, 1000, "seems cut short: it claims 1000 faces"),
        (140 + 96, 5, "face 0 has not 3 or 4 corners"),
        (144 + 96, 9, r"a face uses vertices \[9, 2, 3\] of 4"),
        (136, 0x7FF80000, "vertex 0 lies at .nan"),
    ],
)
def test_damage_is_named(shot, tmp_path, offset, word, fault):
    write_vvd(shot(2, 2, missing=0), tmp_path / "bad.vvd")
    data = bytearray((tmp_path / "bad.vvd").read_bytes())
    struct.pack_into(">i", data, offset, word)
    (tmp_path / "bad.vvd").write_bytes(data)
    with pytest.raises(BadInput, match=f"bad.vvd.*{fault}"):
        load_scan(tmp_path / "bad.vvd")


@pytest.mark.parametrize("size", [134, 200, 233, 250])
def test_a_cut_file_is_named(shot, tmp_path, size):
    write_vvd(shot(2, 2, missing=0), tmp_path / "cut.vvd")
    (tmp_path / "cut.vvd").write_bytes((tmp_path / "cut.vvd").read_bytes()[:size])
    with pytest.raises(BadInput, match=r"cut\.vvd seems cut short"):
        load_scan(tmp_path / "cut.vvd")

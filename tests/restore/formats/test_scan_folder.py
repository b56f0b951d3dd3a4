"""Planish's own scan folder."""

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats import load_scan, save_scan
from restore.formats.folder import _sha256
from restore.scan import RangeScan

coordinates = st.floats(-1e5, 1e5) | st.just(float("nan"))
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def scans(draw):
    rows, cols = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    picture = draw(st.none() | arrays(np.uint8, (draw(st.integers(1, 6)), draw(st.integers(1, 6)), 3)))
    points = draw(arrays(np.float64, (rows, cols, 3), elements=coordinates))
    places = draw(arrays(np.float64, (rows, cols, 2), elements=st.floats(-1e6, 1e6)))
    return RangeScan(points, picture, places, draw(st.dictionaries(st.text(), json_values, max_size=3)))


@settings(deadline=None, max_examples=60)
@given(scan=scans())
def test_any_scan_comes_back_bit_for_bit(scan, tmp_path_factory):
    folder = tmp_path_factory.mktemp("scan")
    save_scan(scan, folder)
    back = load_scan(folder)
    assert back.points.tobytes() == scan.points.tobytes()
    assert back.texture_xy.tobytes() == scan.texture_xy.tobytes()
    assert back.provenance == scan.provenance
    assert (back.texture is None) == (scan.texture is None)
    np.testing.assert_array_equal(back.texture, scan.texture)


def test_places_may_be_unknown_where_nothing_was_measured(shot, tmp_path):
    scan = shot(missing=0.3)
    places = np.where(scan.measured[..., None], scan.texture_xy, np.nan)
    save_scan(replace(scan, texture_xy=places), tmp_path / "a")
    np.testing.assert_array_equal(load_scan(tmp_path / "a").texture_xy, places)


@pytest.mark.parametrize(
    "change, fault",
    [
        (lambda scan: {"texture_xy": scan.texture_xy * np.nan}, "positions that cannot be"),
        (lambda scan: {"points": np.where(np.isnan(scan.points), np.inf, scan.points)}, "positions that cannot be"),
        (lambda scan: {"points": 1e6 * scan.points}, "positions that cannot be"),
        (lambda scan: {"texture_xy": None}, "not arrays"),
        (lambda scan: {"texture_xy": scan.texture_xy[1:]}, "different grids"),
        (lambda scan: {"texture_xy": scan.texture_xy[..., :1]}, "not a range grid"),
        (lambda scan: {"points": scan.points.astype(complex)}, "not of floats"),
        (lambda scan: {"points": scan.points[:0], "texture_xy": scan.texture_xy[:0]}, "0 rows"),
        (lambda scan: {"points": np.zeros((1, 2**21 + 1, 3)), "texture_xy": np.zeros((1, 2**21 + 1, 2))}, "1 rows"),
        (lambda scan: {"texture": scan.texture[..., 0]}, "colour image"),
        (lambda scan: {"texture": np.dstack([scan.texture, scan.texture[..., :1]])}, "colour image"),
        (lambda scan: {"texture": scan.texture / 255.0}, "colour image"),
        (lambda scan: {"texture": scan.texture[:0]}, "no pixels"),
        (lambda scan: {"texture": np.zeros((5000, 5000, 3), np.uint8)}, "too many pixels"),
    ],
)
def test_what_would_not_be_read_back_is_not_saved(shot, tmp_path, change, fault):
    scan = shot()
    with pytest.raises(BadInput, match=fault):
        save_scan(replace(scan, **change(scan)), tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_a_saved_scan_is_not_overwritten_unless_asked(shot, tmp_path):
    save_scan(shot(seed=1), tmp_path / "a")
    with pytest.raises(BadInput, match="a holds a scan already"):
        save_scan(shot(seed=2), tmp_path / "a")
    np.testing.assert_array_equal(load_scan(tmp_path / "a").points, shot(seed=1).points)
    bare = RangeScan(shot(seed=2).points, None, shot(seed=2).texture_xy)
    save_scan(bare, tmp_path / "a", overwrite=True)
    assert load_scan(tmp_path / "a").texture is None
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["points.npz", "scan.json"]


def test_a_file_in_the_place_of_the_folder_stays(shot, tmp_path):
    (tmp_path / "a").write_text("mine")
    with pytest.raises(BadInput, match="a is a file"):
        save_scan(shot(), tmp_path / "a", overwrite=True)
    assert (tmp_path / "a").read_text() == "mine"


def test_provenance_must_be_plain(shot, tmp_path):
    scan = shot()
    for strange in (object(), float("nan")):
        with pytest.raises(BadInput, match="not plain JSON"):
            save_scan(RangeScan(scan.points, None, scan.texture_xy, {"a": strange}), tmp_path / "a")
        assert not (tmp_path / "a").exists()


def test_a_grid_in_another_order_of_memory_comes_back(shot, tmp_path):
    scan = shot()
    save_scan(RangeScan(np.asfortranarray(scan.points), scan.texture, scan.texture_xy), tmp_path / "a")
    np.testing.assert_array_equal(load_scan(tmp_path / "a").points, scan.points)


@pytest.mark.parametrize("name", ["points.npz", "texture.png"])
@pytest.mark.parametrize("damage", ["cut", "changed", "missing"])
def test_a_damaged_file_is_named(shot, tmp_path, name, damage):
    save_scan(shot(), tmp_path)
    path = tmp_path / name
    data = path.read_bytes()
    path.unlink()
    if damage != "missing":
        path.write_bytes(data[:-1] if damage == "cut" else data[:-1] + bytes([data[-1] ^ 1]))
    with pytest.raises(BadInput, match=name):
        load_scan(tmp_path)


def with_points(folder, npz):
    """Put another points.npz into a scan folder, with the right checksum."""
    (folder / "points.npz").write_bytes(npz)
    index = json.loads((folder / "scan.json").read_text())
    index["files"]["points.npz"] = _sha256(npz)
    (folder / "scan.json").write_text(json.dumps(index))


def npz(**grids):
    out = io.BytesIO()
    np.savez_compressed(out, **grids)
    return out.getvalue()


def claiming(shape):
    """An archive whose array says that it is of `shape` and holds nothing."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive, archive.open("points.npy", "w") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return out.getvalue()


@pytest.mark.parametrize(
    ("archive", "fault"),
    [
        (b"not an archive", "points cannot be read"),
        (npz(points=np.zeros((2, 2, 3))), "texture_xy cannot be read"),
        (npz(points=np.zeros((2, 2, 3)), texture_xy=np.zeros((2, 3, 2))), "different grids"),
        (npz(points=np.zeros((2, 2, 2)), texture_xy=np.zeros((2, 2, 2))), "points is not a whole array"),
        (npz(points=np.zeros((2, 2, 3), "f4"), texture_xy=np.zeros((2, 2, 2))), "points is not a whole array"),
        (npz(points=np.full((2, 2, 3), np.inf), texture_xy=np.zeros((2, 2, 2))), "positions that cannot be"),
        (npz(points=np.zeros((2, 2, 3)), texture_xy=np.full((2, 2, 2), np.nan)), "positions that cannot be"),
        (npz(points=np.zeros((0, 2, 3)), texture_xy=np.zeros((0, 2, 2))), "cannot be"),
        (npz(points=np.array([{"a": 1}], dtype=object)), "points is not a whole array"),
        (claiming((10**6, 10**6, 3)), "points is not a whole array"),
        (claiming((10**30, 10**30, 3)), "points is not a whole array"),
    ],
)
def test_an_archive_of_something_else_is_named(shot, tmp_path, archive, fault):
    save_scan(shot(), tmp_path)
    with_points(tmp_path, archive)
    with pytest.raises(BadInput, match=f"points.npz.*{fault}"):
        load_scan(tmp_path)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "is empty"),
        ("{", "Invalid JSON"),
        ("[" * 10**5, "Invalid JSON"),
        ("{}", "files: Field required"),
        ('{"files": {"../x": "0"}}', r"lists the files \['../x'\]"),
        ('{"files": {}}', "lists the files"),
        ('{"files": {}, "version": 2}', "version: Input should be less than or equal to 1"),
        ('{"files": {}, "format": "other"}', "format: Input should be 'planish scan'"),
    ],
)
def test_a_damaged_index_is_named(shot, tmp_path, text, fault):
    save_scan(shot(), tmp_path)
    (tmp_path / "scan.json").write_text(text)
    with pytest.raises(BadInput, match=f"scan.json.*{fault}"):
        load_scan(tmp_path)


def test_a_folder_without_an_index_is_not_a_scan(tmp_path):
    with pytest.raises(BadInput, match=r"is not a scan folder: it has no scan\.json"):
        load_scan(tmp_path)


def test_an_array_of_negative_sides_is_refused(shot, tmp_path):
    """The product of two negative sides is the number of values that are there."""
    save_scan(RangeScan(np.zeros((1, 1, 3)), None, np.zeros((1, 1, 2))), tmp_path / "a")
    path = tmp_path / "a" / "points.npz"
    with zipfile.ZipFile(path) as archive:
        arrays_ = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in arrays_.items():
            archive.writestr(name, data.replace(b"(1, 1, ", b"(-1,-1,").replace(b")", b") ", 1)[: len(data)])
    index = json.loads((tmp_path / "a" / "scan.json").read_text())
    index["files"]["points.npz"] = _sha256(path.read_bytes())
    (tmp_path / "a" / "scan.json").write_text(json.dumps(index))
    with pytest.raises(BadInput, match="not a whole array"):
        load_scan(tmp_path / "a")


@pytest.mark.parametrize(
    "provenance",
    [
        {"super_resolution": 5},
        {"super_resolution": {"factor": "many"}},
        {"super_resolution": {"factor": 10**9}},
        {"turntable": [1]},
        {"turntable": {"deg": 30, "axis": {"point_mm": [0, 0], "direction": [0, 1, 0]}}},
        {"turntable": {"deg": 30, "axis": {"point_mm": [0, 0, 0], "direction": [0, 0, 0]}}},
    ],
)
def test_provenance_that_is_read_is_checked(shot, tmp_path, provenance):
    save_scan(shot(), tmp_path / "a")
    index = json.loads((tmp_path / "a" / "scan.json").read_text())
    (tmp_path / "a" / "scan.json").write_text(json.dumps(index | {"provenance": provenance}))
    with pytest.raises(BadInput, match="provenance"):
        load_scan(tmp_path / "a")


def test_findings_are_stored_with_the_scan(shot, tmp_path):
    found = (Finding.of("cut_off", 0.25), Finding.of("other_surfaces", surfaces="another surface"))
    save_scan(replace(shot(), findings=found), tmp_path / "a")
    assert load_scan(tmp_path / "a").findings == found


@pytest.mark.parametrize("findings", [[{"code": 3}], [{"code": "hidden", "severity": "grave", "text": "a"}], "none"])
def test_invalid_findings_are_refused(shot, tmp_path, findings):
    save_scan(shot(), tmp_path / "a")
    index = json.loads((tmp_path / "a" / "scan.json").read_text())
    (tmp_path / "a" / "scan.json").write_text(json.dumps(index | {"findings": findings}))
    with pytest.raises(BadInput, match="findings"):
        load_scan(tmp_path / "a")

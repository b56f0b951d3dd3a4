"""NumPy arrays of points; pickled objects and arrays made to fill the memory are refused."""

import io
import zipfile

import numpy as np
import pytest

from oracles.clouds import CAMERA, colours_of_samples, write_npy, write_npz
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.arrays import read_arrays


def test_points_and_colours_of_an_archive(tmp_path, sheet, same_as):
    write_npz(tmp_path / "a.npz", sheet, snr=np.ones(sheet.points.shape[:2], np.float32))
    same_as(load_scan(tmp_path / "a.npz"), sheet)


def test_an_array_takes_the_picture_in_its_folder(tmp_path, sheet, same_as):
    write_npy(tmp_path / "a.npy", sheet)
    same_as(load_scan(tmp_path / "a.npy"), sheet)


def test_coordinates_in_three_arrays_and_grey(tmp_path, sheet, same_as):
    x, y, z = np.moveaxis(sheet.points * CAMERA, 2, 0)
    np.savez(tmp_path / "a.npz", x=x, y=y, z=z, intensity=colours_of_samples(sheet)[..., 0].astype(float))
    scan = load_scan(tmp_path / "a.npz")
    same_as(scan, sheet, colours=False)
    assert np.ptp(scan.texture) > 200


def test_records_with_fields(tmp_path, sheet, same_as):
    table = np.zeros(sheet.points.shape[:2], [(n, "f4") for n in "xyz"] + [("rgb", "u1", 3)])
    for k, name in enumerate("xyz"):
        table[name] = (sheet.points * CAMERA)[..., k]
    table["rgb"] = colours_of_samples(sheet)
    np.save(tmp_path / "a.npy", table)
    same_as(load_scan(tmp_path / "a.npy"), sheet)


def test_columns_of_fortran(tmp_path, sheet, same_as):
    both = np.dstack([sheet.points * CAMERA, colours_of_samples(sheet)])
    np.save(tmp_path / "a.npy", np.asfortranarray(both))
    same_as(load_scan(tmp_path / "a.npy"), sheet)


def test_pickled_objects_are_never_read(tmp_path):
    class Harmful:
        def __reduce__(self):
            return (pytest.fail, ("a pickle was read",))

    np.save(tmp_path / "a.npy", np.array([Harmful()], object), allow_pickle=True)
    np.savez(tmp_path / "a.npz", xyz=np.array([Harmful()], object))
    for name in ("a.npy", "a.npz"):
        with pytest.raises(BadInput, match="never read"):
            load_scan(tmp_path / name)


@pytest.mark.parametrize("shape", [(2**13, 2**10, 3), (2**40, 3), (-5, 3), (0, 3), (3,), (2, 2, 2, 3)])
def test_an_archive_made_to_fill_the_memory(tmp_path, shape):
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"shape": shape, "fortran_order": False, "descr": "<f8"})
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xyz.npy", header.getvalue() + bytes(2**26))
    with pytest.raises(BadInput):
        load_scan(tmp_path / "a.npz")


def test_colours_of_another_grid_are_refused(tmp_path):
    np.savez(tmp_path / "a.npz", xyz=np.ones((8, 9, 3)), rgb=np.zeros((9, 8, 3), np.uint8))
    with pytest.raises(BadInput, match="do not fit"):
        load_scan(tmp_path / "a.npz")


def test_an_archive_without_points_names_its_arrays(tmp_path):
    np.savez(tmp_path / "a.npz", rgb=np.zeros((9, 8, 3)), intensity=np.zeros((9, 8)))
    with pytest.raises(BadInput, match="no array of points among intensity, rgb"):
        read_arrays(tmp_path / "a.npz")

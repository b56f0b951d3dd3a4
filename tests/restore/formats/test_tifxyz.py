"""tifxyz folders of Volume Cartographer."""

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.tifxyz import is_tifxyz
from restore.mesh.ordered_grid import GridMesh
from tests.restore.formats.test_damaged_files import mutate

MUTANTS = 300  # of each file, from a fixed seed
ROWS, COLS = 4, 5
SINGLE = 1e-6  # relative: the pictures are of single precision


def grid():
    rows, cols = np.indices((ROWS, COLS))
    return np.dstack([20.0 * cols + 100, 300.0 - 0.5 * cols**2, 20.0 * rows + 50])


@pytest.fixture
def folder(tmp_path):
    return written(tmp_path / "segment")


def written(folder, points=None, compression=None, **meta):
    folder.mkdir(exist_ok=True)
    points = grid() if points is None else points
    for name, axis in zip("xyz", np.moveaxis(points, 2, 0), strict=True):
        Image.fromarray(axis.astype(np.float32)).save(folder / f"{name}.tif", compression=compression)
    fields = {"format": "tifxyz", "scale": [0.05, 0.05], "type": "seg", "uuid": "a", "bbox": [[0, 0, 0], [1, 1, 1]]}
    (folder / "meta.json").write_text(json.dumps(fields | meta))
    return folder


@pytest.mark.parametrize("compression", [None, "tiff_lzw"])
def test_points_come_back_in_the_order_of_the_grid(tmp_path, compression):
    mesh = load_scan(written(tmp_path / "a", compression=compression), unit="2um")
    assert isinstance(mesh, GridMesh)
    np.testing.assert_allclose(mesh.vertices, grid().reshape(-1, 3) * 2e-3, rtol=SINGLE)
    assert mesh.shape == (ROWS, COLS)
    assert len(mesh.faces) == 2 * (ROWS - 1) * (COLS - 1)


def test_points_at_no_height_are_invalid(tmp_path):
    points = grid()
    points[1, 2], points[0, 0, 2] = -1.0, 0.0
    mesh = load_scan(written(tmp_path / "a", points), unit="mm")
    assert set(range(ROWS * COLS)) - set(mesh.places.tolist()) == {0, COLS + 2}


@pytest.mark.parametrize("finer", [1, 3])
def test_a_mask_of_the_grid_or_finer_takes_points_out(folder, finer):
    mask = np.full((finer * ROWS, finer * COLS), 255, np.uint8)
    mask[finer * 2, finer * 3 + finer - 1] = 254
    Image.fromarray(mask).save(folder / "mask.tif")
    assert set(range(ROWS * COLS)) - set(load_scan(folder).places.tolist()) == {2 * COLS + 3}
    Image.fromarray(np.dstack([mask, 0 * mask, 0 * mask])).save(folder / "mask.tif")  # its first channel counts
    assert len(load_scan(folder).places) == ROWS * COLS - 1


def test_a_mask_of_another_grid_is_not_used(folder):
    Image.fromarray(np.zeros((ROWS + 1, COLS), np.uint8)).save(folder / "mask.tif")
    assert len(load_scan(folder).places) == ROWS * COLS


def test_the_areas_show_the_size_of_a_voxel(tmp_path):
    areas = {"area_vx2": 4.0e6, "area_cm2": 4.0e6 * 7.91**2 / 1e8}
    mesh = load_scan(written(tmp_path / "a", **areas))
    np.testing.assert_allclose(mesh.vertices, grid().reshape(-1, 3) * 7.91e-3, rtol=SINGLE)
    assert mesh.provenance["unit_source"] == "format"
    given = load_scan(tmp_path / "a", unit="10um")
    np.testing.assert_allclose(given.vertices, grid().reshape(-1, 3) * 1e-2, rtol=SINGLE)


@pytest.mark.parametrize("areas", [{}, {"area_vx2": 1e6, "area_cm2": None}, {"area_vx2": 0.0, "area_cm2": 1.0}])
def test_without_areas_a_size_is_assumed_with_a_warning(tmp_path, areas):
    assert "size of a voxel" in load_scan(written(tmp_path / "a", **areas)).findings[0].text


def test_the_coordinates_decide_and_not_the_scale_that_is_written(tmp_path):
    """Converters write it too small by the size of a voxel or more."""
    scale = 0.05
    plain, wrong = (
        load_scan(written(tmp_path / name, scale=[value] * 2), unit="10um")
        for name, value in (("plain", scale), ("wrong", scale / 173))
    )
    np.testing.assert_array_equal(wrong.vertices, plain.vertices)


def test_a_picture_lies_over_the_whole_grid(folder, tmp_path):
    Image.fromarray(np.zeros((10 * ROWS, 10 * COLS, 3), np.uint8)).save(tmp_path / "ink.png")
    mesh = load_scan(folder, tmp_path / "ink.png")
    np.testing.assert_allclose(mesh.texcoords[0], [4.5, 4.5])  # the middle of the first cell of 10 × 10 pixels
    np.testing.assert_allclose(mesh.texcoords[-1], [10 * COLS - 5.5, 10 * ROWS - 5.5])
    Image.fromarray(np.zeros((10, 100, 3), np.uint8)).save(tmp_path / "other.png")
    with pytest.raises(BadInput, match="does not fit"):
        load_scan(folder, tmp_path / "other.png")


def test_a_folder_of_another_kind_is_refused(tmp_path, folder):
    assert is_tifxyz(folder)
    assert not is_tifxyz(tmp_path)
    (folder / "x.tif").unlink()
    assert not is_tifxyz(folder)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("meta.json", b"{", "meta.json"),
        ("meta.json", b'{"format": "zarr"}', "'zarr'"),
        ("meta.json", b'{"area_vx2": "x"}', "area_vx2|validation"),
        ("y.tif", b"x", "y.tif"),
        ("y.tif", cv2.imencode(".tif", np.zeros((3, 4)))[1].tobytes(), "double precision"),
        ("z.tif", None, "does not exist"),
    ],
)
def test_damaged_and_missing_files_are_named(folder, name, data, message):
    (folder / name).unlink()
    if data is not None:
        (folder / name).write_bytes(data)
    with pytest.raises(BadInput, match=message) as caught:
        load_scan(folder)
    assert caught.value.hint


def test_coordinates_of_different_sizes_or_in_colour_are_refused(folder):
    Image.fromarray(np.zeros((ROWS, COLS + 1), np.float32)).save(folder / "y.tif")
    with pytest.raises(BadInput, match="different sizes"):
        load_scan(folder)
    Image.fromarray(np.zeros((ROWS, COLS, 3), np.uint8)).save(folder / "y.tif")
    with pytest.raises(BadInput, match="kind RGB"):
        load_scan(folder)


def test_a_picture_of_more_pixels_than_any_segment_is_refused_before_it_is_decoded(folder):
    Image.fromarray(np.zeros((3000, 3000), np.float32)).save(folder / "y.tif", compression="tiff_lzw")
    with pytest.raises(BadInput, match="3000 × 3000 points"):
        load_scan(folder)


@pytest.mark.parametrize("name", ["x.tif", "z.tif", "meta.json"])
def test_damage_ends_in_a_segment_or_one_clear_error(folder, name):
    rng, sound = np.random.default_rng([7, *name.encode()]), (folder / name).read_bytes()
    for _ in range(MUTANTS):
        (folder / name).write_bytes(mutate(sound, rng))
        try:
            mesh = load_scan(folder)
        except BadInput as error:
            assert str(folder) in str(error)
            assert error.hint
        else:
            assert np.isfinite(mesh.vertices).all()
            assert mesh.faces.max() < len(mesh.vertices) == len(mesh.places)

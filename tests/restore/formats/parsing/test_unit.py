"""The unit of a mesh file."""

import numpy as np
import pytest
import trimesh

from restore import Settings, restore
from restore.errors import BadInput
from restore.formats import load_scan, save_scan, write_obj
from restore.numerics.units import UNIT_MM
from restore.prepared.prepare import prepare
from restore.prepared.size import MAX_PAGE_MM, MIN_PAGE_MM
from restore.scan import SurfaceMesh

PAGE_MM = np.array([210.0, 148.0, 0.0])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
FLOAT32 = 1e-6  # relative: GLB has single precision


def sheet(size):
    """A flat rectangle of size (3,)."""
    return SurfaceMesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]) * np.asarray(size, float), FACES)


@pytest.fixture
def obj(tmp_path):
    def write(size):
        write_obj(sheet(size), tmp_path / "page.obj")
        return tmp_path / "page.obj"

    return write


@pytest.fixture
def glb(tmp_path):
    def write(size):
        mesh = sheet(size)
        path = tmp_path / "page.glb"
        path.write_bytes(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(file_type="glb"))
        return path

    return write


@pytest.mark.parametrize("unit", UNIT_MM)
def test_a_mesh_is_brought_to_millimetres_from_its_unit(obj, unit):
    mesh = load_scan(obj(PAGE_MM / UNIT_MM[unit]), unit=unit)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), PAGE_MM, atol=0.5e-4 * UNIT_MM[unit])  # four decimals
    assert (mesh.provenance["unit"], mesh.provenance["unit_source"]) == (unit, "given")


def test_without_a_unit_of_its_format_a_mesh_is_in_millimetres(obj):
    mesh = load_scan(obj(PAGE_MM))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), PAGE_MM)
    assert "unit" not in mesh.provenance


def test_glb_is_in_metres_as_its_standard_says(glb):
    mesh = load_scan(glb(PAGE_MM / 1000))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), PAGE_MM, rtol=FLOAT32)
    assert (mesh.provenance["unit"], mesh.provenance["unit_source"]) == ("m", "format")
    assert mesh.findings == ()


def test_glb_that_cannot_be_in_metres_is_in_millimetres_with_a_warning(glb):
    mesh = load_scan(glb(PAGE_MM))
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), PAGE_MM, rtol=FLOAT32)
    assert "too large for m" in mesh.findings[0].text
    assert mesh.findings[0] in restore(mesh, Settings(dpi=50)).findings


@pytest.mark.parametrize(
    ("size", "asked"),
    [
        ((8, 6, 0), "in (203 mm)"),
        ((28_000, 20_000, 0), "--unit"),
        ((11.7, 8.3, 0), "cm (117 mm)"),
        ((0.3, 0.2, 0), "m ("),
    ],
)
def test_a_size_that_no_page_has_asks_for_the_unit(obj, size, asked):
    mesh = load_scan(obj(size))
    with pytest.raises(BadInput, match="is mm its unit") as raised:
        prepare(mesh)
    assert asked in raised.value.hint


def test_a_glb_of_other_numbers_asks_for_the_unit(glb):
    with pytest.raises(BadInput, match=r"measures 29.7 m .* is m its unit") as raised:
        prepare(load_scan(glb((29.7, 21.0, 0))))
    assert "cm (297 mm)" in raised.value.hint


@pytest.mark.parametrize("size", [MIN_PAGE_MM * 0.5, MAX_PAGE_MM * 1.5])
def test_a_given_unit_is_not_asked_for(obj, size):
    prepare(load_scan(obj((size, size / 2, 0)), unit="mm"))


def test_a_unit_that_puts_a_vertex_out_of_range_is_refused(obj):
    with pytest.raises(BadInput, match="210 m from the origin"):
        load_scan(obj(PAGE_MM), unit="m")


def test_a_range_image_has_its_unit(shot, tmp_path):
    save_scan(shot(), tmp_path / "a")
    assert load_scan(tmp_path / "a", unit="mm").points.shape == shot().points.shape
    with pytest.raises(BadInput, match="range image"):
        load_scan(tmp_path / "a", unit="cm")


def test_an_unknown_unit_is_refused(obj):
    with pytest.raises(BadInput, match="'ft' is not a unit"):
        load_scan(obj(PAGE_MM), unit="ft")

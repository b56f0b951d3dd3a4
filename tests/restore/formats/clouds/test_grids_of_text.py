"""PTX, Gocator's CSV and E57: grids come back right, whichever way their columns run."""

import numpy as np
import pytest

from oracles.clouds import write_e57, write_gocator, write_ptx
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.e57 import read_e57
from restore.formats.clouds.gocator import is_gocator
from restore.formats.clouds.ptx import read_ptx
from restore.scan import RangeScan


def test_columns_of_ptx_from_the_bottom_up(tmp_path, sheet, same_as):
    write_ptx(tmp_path / "a.ptx", sheet)
    scan = load_scan(tmp_path / "a.ptx")
    same_as(scan, sheet)
    assert (scan.provenance["unit"], scan.provenance["unit_source"]) == ("m", "format")


def test_columns_of_ptx_from_right_to_left(tmp_path, sheet):
    turned = RangeScan(sheet.points[:, ::-1], sheet.texture, sheet.texture_xy[:, ::-1])
    write_ptx(tmp_path / "a.ptx", turned)
    scan = load_scan(tmp_path / "a.ptx")
    np.testing.assert_allclose(scan.points, sheet.points, atol=2e-4)


def test_several_scans_of_ptx_are_one_cloud(tmp_path, sheet):
    write_ptx(tmp_path / "a.ptx", sheet, scans=2)
    cloud = read_ptx(tmp_path / "a.ptx")
    assert cloud.size is None
    assert cloud.measured.sum() == 2 * sheet.measured.sum()


def test_a_section_of_a_gocator(tmp_path, sheet):
    write_gocator(tmp_path / "a.csv", sheet)
    assert is_gocator((tmp_path / "a.csv").read_bytes())
    assert not is_gocator(b"x,y,z\n1,2,3\n")
    scan = load_scan(tmp_path / "a.csv")
    both = scan.measured
    np.testing.assert_array_equal(both, sheet.measured)
    a, b = scan.points[both], sheet.points[both]
    u, _, vt = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    assert np.linalg.det(u @ vt) > 0
    np.testing.assert_allclose((a - a.mean(0)) @ u @ vt, b - b.mean(0), atol=1e-3)


@pytest.mark.parametrize("grid", [True, False])
def test_a_scan_of_e57(tmp_path, sheet, same_as, grid):
    write_e57(tmp_path / "a.e57", sheet, grid=grid)
    if grid:
        same_as(load_scan(tmp_path / "a.e57"), sheet)
    else:
        cloud = read_e57(tmp_path / "a.e57")
        assert cloud.size is None
        np.testing.assert_allclose(cloud.points, (sheet.points * [1, -1, -1])[sheet.measured] * 1e-3, atol=1e-6)


@pytest.mark.parametrize("write", [write_ptx, write_gocator, write_e57])
@pytest.mark.parametrize("part", [0.02, 0.5, 0.9])
def test_a_file_that_is_cut_short_is_named(tmp_path, sheet, write, part):
    path = tmp_path / f"a.{'csv' if write is write_gocator else write.__name__[-3:]}"
    write(path, sheet)
    data = path.read_bytes()
    path.write_bytes(data[: int(part * len(data))])
    with pytest.raises(BadInput, match=path.name):
        load_scan(path)

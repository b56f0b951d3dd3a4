"""Shots as scans: arrays as they are, files read."""

from __future__ import annotations

import pytest

from drivers import ScanFile
from restore import BadInput, SurfaceMesh
from station.run.shots import range_image_of, read_shot
from station.run.small_page import small_page
from tests.drivers.program.conftest import MESH


def test_a_shot_is_its_scan_and_a_file_is_read(tmp_path):
    page = small_page()
    assert read_shot(page) is page
    (tmp_path / "a.obj").write_text(MESH)
    scan = read_shot(ScanFile(tmp_path / "a.obj", {"unit": "cm"}))
    assert isinstance(scan, SurfaceMesh)
    assert scan.vertices.max() == pytest.approx(1000)
    with pytest.raises(BadInput, match="a preview needs a range image"):
        range_image_of(ScanFile(tmp_path / "a.obj"), "a preview")


def test_a_file_that_is_not_a_scan_is_kept_and_named(tmp_path):
    (tmp_path / "a.obj").write_text("v 1")
    with pytest.raises(BadInput) as caught:
        read_shot(ScanFile(tmp_path / "a.obj", folder=tmp_path))
    assert caught.value.hint.endswith(f"the file is kept: {tmp_path / 'a.obj'}")

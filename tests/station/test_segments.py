"""Segments of CT volumes through the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from restore import load_scan
from station.choices import Sheets
from station.cli import main
from station.run.pieces import select_sheets
from tests.restore.flattening.test_ordered_grid import spiral

SIZE = 0.005  # of the page: its picture ends with whole pixels


@pytest.fixture
def segment(tmp_path):
    points, _ = spiral()
    rows, cols, _ = points.shape
    header = f"width: {cols}\nheight: {rows}\ndim: 3\nordered: true\ntype: float\nversion: 1\n<>\n"
    (tmp_path / "scroll.vcps").write_bytes(header.encode() + points.astype("<f4").tobytes())
    return tmp_path / "scroll.vcps"


def test_a_segment_becomes_a_page_of_the_size_that_its_voxels_have(segment, tmp_path):
    _, flat = spiral()
    options = ["--unit", "250um", "--dpi", "60", "--points", "400", "-o", str(tmp_path / "out")]
    assert main(["restore", str(segment), *options]) == 0
    report = json.loads((tmp_path / "out" / "scroll.json").read_text())
    np.testing.assert_allclose(report["page_mm"], 0.25 * np.ptp(flat.reshape(-1, 2), axis=0), rtol=SIZE)
    assert report["points"] < 800
    assert report["flipped_faces"] == 0
    assert (tmp_path / "out" / "scroll.png").is_file()


@pytest.mark.parametrize("unit", ["7.91", "um", "0um", "7,91um", "-1mm", "1e5mm", "ft"])
def test_what_is_not_a_unit_is_an_error_of_usage(segment, tmp_path, unit):
    assert main(["restore", str(segment), "--unit", unit, "-o", str(tmp_path / "out")]) == 2


@pytest.mark.parametrize("pieces", Sheets)
def test_a_segment_is_one_sheet_whatever_its_gaps(segment, pieces):
    scan = load_scan(segment)
    assert [selected.scan for selected in select_sheets(scan, pieces)] == [scan]

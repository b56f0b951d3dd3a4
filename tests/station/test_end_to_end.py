"""The real thing: a simulated scanner, the real restoration, real files."""

from __future__ import annotations

import json
import os
import signal

import cv2
import numpy as np
import pytest
import tifffile
from PIL import Image

from station.cli import main
from station.run import one_page

PAGE_MM = (280.0, 200.0)
SIZE_MM = 0.7  # the outline is known to a sample and a half of 0.47 mm
DPI = 150
LEVELS = 6.0  # of 255, mean: bicubic kernels differ between the page's painter and the one used here

EXTRAS = ("--map", "--mesh", "--strain", "--frames", "--tiff")
TIMED = {"seconds", "peak_memory_mb"}  # of the run, not of the page

CONFIG = """
[scanner]
driver = "simulated"
seed = 1
[scanner.scene]
artwork = "text"
page_mm = [280, 200]
[output]
stem = "leaf"
"""


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """What one `planish scan` leaves."""
    folder = tmp_path_factory.mktemp("scan")
    (folder / "station.toml").write_text(CONFIG)
    assert main(["scan", "--config", str(folder / "station.toml"), "-o", str(folder / "out"), *EXTRAS]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def report(out):
    return json.loads((out / "leaf.json").read_text())


def test_every_file_exists_and_is_reported(out, report):
    assert {path.name for path in out.iterdir()} == {"leaf.scan", *report["files"]}


def test_the_page_is_true_to_scale(out, report):
    assert report["page_mm"] == pytest.approx(PAGE_MM, abs=SIZE_MM)
    with Image.open(out / "leaf.png") as picture:
        assert picture.info["dpi"] == pytest.approx((DPI, DPI), abs=0.02)
        size_mm = np.array(picture.size) / DPI * 25.4
    assert size_mm == pytest.approx(PAGE_MM, abs=2 * SIZE_MM)


def test_the_report_is_sound(report):
    assert report["flipped_faces"] == 0
    assert abs(report["area_ratio"] - 1) < 0.01
    assert report["strain"]["rms"] < 0.01
    assert report["shading"] == "keep"
    assert all(seconds >= 0 for seconds in report["seconds"].values())
    assert 100 < report["peak_memory_mb"] < 100_000


def test_the_map_paints_the_same_page_from_the_original(out):
    page_map = tifffile.imread(out / "leaf-map.tif")
    page = np.asarray(Image.open(out / "leaf.png"), float)
    original = np.asarray(Image.open(out / "leaf.scan" / "texture.png"))
    again = cv2.remap(original, page_map, None, cv2.INTER_CUBIC).astype(float)
    seen = np.isfinite(page_map).all(axis=2)
    assert page_map.shape[:2] == page.shape[:2]
    assert np.abs(again - page)[seen].mean() < LEVELS
    assert np.abs(np.roll(again, 4, axis=1) - page)[seen].mean() > LEVELS  # the measure can fail


@pytest.mark.slow
def test_a_stored_scan_gives_the_same_files_to_the_byte(out, report, tmp_path):
    assert main(["restore", str(out / "leaf.scan"), "-o", str(tmp_path), "--review", *EXTRAS]) == 0
    again = json.loads((tmp_path / "leaf.json").read_text())
    assert {name for name in report["files"] if (out / name).read_bytes() != (tmp_path / name).read_bytes()} == {
        "leaf.json"
    }
    assert {key for key in report.keys() | again.keys() if report.get(key) != again.get(key)} <= TIMED


def test_a_table_without_a_page_is_not_enough_surface(tmp_path, capsys):
    from restore import RangeScan
    from restore.formats import save_scan

    nothing = np.full((48, 64, 3), np.nan)
    texture_xy = np.stack(np.meshgrid(np.arange(64.0), np.arange(48.0)), axis=2)
    save_scan(RangeScan(nothing, np.zeros((48, 64, 3), np.uint8), texture_xy, {}), tmp_path / "empty")
    assert main(["restore", str(tmp_path / "empty"), "-o", str(tmp_path / "out")]) == 5
    assert capsys.readouterr().err.startswith("planish: ")


@pytest.mark.parametrize("content", [b"", b"480 rows\n640 columns\npixels (flag X Y Z):\n0 0 1", bytes(range(256))])
def test_a_damaged_scan_is_bad_input(tmp_path, capsys, content):
    (tmp_path / "book.abs").write_bytes(content)
    assert main(["restore", str(tmp_path / "book.abs"), "-o", str(tmp_path / "out")]) == 3
    assert "book.abs" in capsys.readouterr().err


def test_ctrl_c_is_reported_in_a_line_and_keeps_the_scan(tmp_path, monkeypatch, capfd):
    (tmp_path / "station.toml").write_text(CONFIG + '[capture]\nmode = "fast"\n')
    monkeypatch.setattr(one_page, "restore", lambda *_, **__: os.kill(os.getpid(), signal.SIGINT))
    assert main(["scan", "--config", str(tmp_path / "station.toml"), "-o", str(tmp_path / "out")]) == 130
    reported = capfd.readouterr().err
    assert reported.startswith("planish: stopped by Ctrl-C\n")
    assert "Traceback" not in reported
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["leaf.scan"]

"""The examples run as they are written, on a simulated page whose size is known."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Curl, Text, shoot
from restore import save_scan

EXAMPLES = Path(__file__).parent.parent / "examples"
PAGE_MM = (200.0, 150.0)
SIZE_MM = 2.0  # on either side a sample of FAST, 0.94 mm


@pytest.fixture(scope="module")
def scan():
    return shoot(Curl(), Text(), mode="fast", page_mm=PAGE_MM)[0]


def main_of(name):
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"]


def size_mm(picture):
    with Image.open(picture) as page:
        return [side / dpi * 25.4 for side, dpi in zip(page.size, page.info["dpi"], strict=True)]


def test_every_example_is_tested_here():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {"library", "batch", "own_driver"}


def test_library(scan, tmp_path, capsys):
    save_scan(scan, tmp_path / "page.scan")
    main_of("library")(tmp_path / "page.scan", tmp_path / "page.png")
    assert size_mm(tmp_path / "page.png") == pytest.approx(PAGE_MM, abs=SIZE_MM)
    assert "pixels per inch" in capsys.readouterr().out


def test_batch_goes_on_after_a_scan_that_cannot_be_read(scan, tmp_path, capsys):
    save_scan(scan, tmp_path / "scans" / "b.scan")
    (tmp_path / "scans" / "a.obj").write_text("not a mesh")
    assert main_of("batch")(tmp_path / "scans", tmp_path / "pages") == 1
    report = json.loads((tmp_path / "pages" / "b.json").read_text())
    assert report["page_mm"] == pytest.approx(PAGE_MM, abs=SIZE_MM)
    assert capsys.readouterr().out.startswith("a.obj: ")


def test_own_driver(scan, tmp_path, capsys):
    np.savez(tmp_path / "shot.npz", points=scan.points, colour=scan.texture[::2, ::2])  # FAST: every second pixel
    main_of("own_driver")(tmp_path)
    width, height = capsys.readouterr().out.removeprefix("shot.npz: ").removesuffix(" mm\n").split(" × ")
    assert (float(width), float(height)) == pytest.approx(PAGE_MM, abs=SIZE_MM)

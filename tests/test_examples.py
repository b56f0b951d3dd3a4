"""The examples run as they are written, on a simulated page whose size is known."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Curl, Flat, Pose, Text, shoot
from drivers.simulated.scene.artwork import Markers
from oracles.simulation.photographs import Shots, photograph_page
from restore import ScaleCard, save_scan
from tests.restore.turntable.conftest import PAGE_MM as TURNED_MM
from tests.restore.turntable.conftest import turned

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
    assert {path.stem for path in EXAMPLES.glob("*.py")} == {
        "library",
        "batch",
        "own_driver",
        "turntable",
        "photographs",
    }


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


@pytest.mark.slow
def test_turntable(tmp_path, capsys):
    turns = (0.0, 90.0)
    for name, artwork in (("board", Markers()), ("views", Text())):
        for scan, turn in zip(turned(Flat(), artwork, Pose(), turns).scans, turns, strict=True):
            save_scan(scan, tmp_path / name / f"{turn:g}.scan")
    main_of("turntable")(tmp_path / "board", tmp_path / "views", tmp_path / "page.png")
    assert size_mm(tmp_path / "page.png") == pytest.approx(TURNED_MM, abs=SIZE_MM)
    assert "left out" not in capsys.readouterr().out


@pytest.mark.slow
def test_photographs(tmp_path, capsys):
    pytest.importorskip("pycolmap")
    dpi = 177.8  # of the card: seven pixels to a millimetre
    card = {"card": ScaleCard().picture(dpi), "card_dpi": dpi}
    shots = Shots(size=(1200, 900))
    taken = photograph_page(Curl(), Text(), views=5, seed=3, shots=shots, page_mm=(160.0, 110.0), **card)
    (tmp_path / "photographs").mkdir()
    main_of("photographs")(tmp_path / "page.png", *taken.save(tmp_path / "photographs"))
    assert size_mm(tmp_path / "page.png") == pytest.approx((160.0, 110.0), abs=SIZE_MM)
    assert "from 5 photographs" in capsys.readouterr().out

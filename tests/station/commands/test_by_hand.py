"""`planish restore --spine`, `--outline` and so on: each builds the corrections that a file would have."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from restore import parse_edits, save_scan
from restore.formats import write_obj
from restore.mesh.triangulate import triangulate
from station.choices import Layout
from station.cli import main
from station.commands.by_hand import ByHand
from station.images.pages import read_page
from station.run.edits import digest_of
from tests.restore.layout.conftest import PAGE_MM, SPINE_MM, shot

NO_MAP = Path("gone-map.tif")
COARSE = ["--dpi", "50", "--points", "300"]
ERROR_MM = 0.7  # two thirds of a sample of the fast mode


def px(x_mm, y_mm):
    """Pixels of the colour image where a place of the printed page is seen, as an option has them."""
    scan, truth = shot(False)
    apart = np.hypot(truth.flat[..., 0] - x_mm, truth.flat[..., 1] - y_mm)
    x, y = scan.texture_xy[np.unravel_index(np.nanargmin(apart), apart.shape)]
    return f"{x:.2f},{y:.2f}"


def box(left, bottom, right, top):
    return ":".join([px(left, top), px(right, top), px(right, bottom), px(left, bottom)])


@pytest.fixture
def book(tmp_path):
    """A scan folder of an opened book."""
    save_scan(shot(False)[0], tmp_path / "book.scan")
    return tmp_path / "book.scan"


def reports(out):
    return {path.stem: json.loads(path.read_text()) for path in sorted(out.glob("*.json"))}


def test_a_spine_splits_where_it_was_drawn_and_an_outline_keeps_the_split(book, tmp_path):
    drawn, out = box(10.0, 10.0, 190.0, 120.0), tmp_path / "out"
    command = ["restore", str(book), "-o", str(out), *COARSE]
    assert main([*command, "--map"]) == 0
    spine = f"{SPINE_MM - 10},2:{SPINE_MM - 10},128mm"  # of that result
    assert main([*command, "--force", "--spine", spine, "--outline", drawn]) == 0
    found = reports(out)
    assert list(found) == ["book-left", "book-right"]
    widths = (SPINE_MM - 10 - 10, 190 - SPINE_MM + 10)
    for name, width in zip(found, widths, strict=True):
        assert found[name]["leaf_mm"] == pytest.approx((width, 110.0), abs=2 * ERROR_MM)


def test_saved_corrections_give_the_same_page_to_the_byte(tmp_path):
    write_obj(triangulate(shot(False)[0]), tmp_path / "book.obj")
    scan, saved = tmp_path / "book.obj", tmp_path / "book.edits.json"
    first, second = tmp_path / "one", tmp_path / "two"
    words = ["--remove", box(20.0, 20.0, 60.0, 60.0), "--angle", "1.5", "--crop", "margin:3", "--size", "200x130.5"]
    assert main(["restore", str(scan), "-o", str(first), *COARSE, *words, "--save-edits", str(saved)]) == 0
    edits = parse_edits(saved.read_bytes(), "saved")
    assert (edits.scan, edits.layout, list(edits.parts)) == (digest_of(scan), "whole", ["page"])
    assert main(["restore", str(scan), "-o", str(second), *COARSE]) == 0
    pages = [reports(folder)["book"] for folder in (first, second)]
    assert pages[0]["coverage"]["erased"] == pages[1]["coverage"]["erased"] > 0.05
    assert (first / "book.png").read_bytes() == (second / "book.png").read_bytes()
    cropped, whole = (read_page(first / f"book{ending}.png").image for ending in ("", "-uncropped"))
    assert whole.shape[0] < cropped.shape[0]  # by the margin
    assert not [
        one for one in pages[0]["findings"] if one["code"].startswith("size_")
    ]  # the box of a rotated page is larger
    assert main(["restore", str(scan), "-o", str(second), *COARSE, "--save-edits", str(saved)]) == 2  # it is there


def test_another_size_than_was_given_is_reported_and_scales_nothing(book, tmp_path):
    out = tmp_path / "out"
    assert main(["restore", str(book), "-o", str(out), *COARSE, "--size", "200x133.5"]) == 0
    report = reports(out)["book"]
    assert report["page_mm"] == pytest.approx(PAGE_MM, abs=ERROR_MM)
    assert [one["code"] for one in report["findings"] if one["code"] == "size_differs"] == ["size_differs"]


def test_options_win_over_the_file_field_by_field():
    stored = parse_edits(b'{"layout": "split", "parts": {"left": {"turn": 1, "rotate_deg": 2.0}}}', "file")
    edits = ByHand(angle=0.5).over(stored, Layout.SINGLE, NO_MAP)
    assert edits.given()["parts"] == {"left": {"turn": 1, "rotate_deg": 0.5}, "right": {"rotate_deg": 0.5}}
    assert ByHand().over(stored, Layout.WHOLE, NO_MAP) is stored
    assert list(ByHand(angle=0.5).over(None, Layout.AUTO, NO_MAP).parts) == ["page", "left", "right"]
    assert ByHand(angle=0.5).over(None, Layout.SINGLE, NO_MAP).layout == "whole"
    assert ByHand(spine="1,2:1,9").over(None, Layout.SINGLE, NO_MAP).layout == "split"


@pytest.mark.parametrize(
    ("words", "code", "reason"),
    [
        (["--spine", "abc"], 2, "--spine: 'abc' cannot be read"),
        (["--outline", "1,2:3,4"], 2, "--outline: "),
        (["--outline", ""], 2, "--outline is empty"),
        (["--crop", "box:5,5,1,1"], 2, "--crop: "),
        (["--angle", "90"], 2, "--angle: "),
        (["--angle", "nan"], 2, "--angle: "),
        (["--outline", "1,1:9,1:9,9mm"], 3, "book-map.tif does not exist"),
        (["--spine", "1,1:xmm"], 2, "--spine: '1,1:xmm' cannot be read"),
        (["--overlap", "11"], 2, "--overlap: "),
        (["--save-edits", "saved.json"], 2, "has no corrections"),
        (["--outline", "0,0:60,60:60,0:0,60"], 3, "crosses itself"),
        (["--outline", "5000,0:5000,9:6000,9"], 3, "outside the image"),
        (["--spine", "10,200:600,201"], 3, "head to tail"),
        (["--remove", "0,0:639,0:639,479:0,479"], 5, "leave 0.0%"),
    ],
)
def test_what_cannot_be_is_refused_and_writes_nothing(book, tmp_path, monkeypatch, capsys, words, code, reason):
    monkeypatch.chdir(tmp_path)
    assert main(["restore", str(book), "-o", "out", *COARSE, *words]) == code
    assert reason in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.rglob("*") if book not in path.parents) == ["book.scan"]

"""`planish layout` and `planish restore --layout`."""

from __future__ import annotations

import json

import pytest

from restore import save_scan
from station.cli import main
from tests.restore.layout.conftest import SPINE_MM, shot


@pytest.fixture
def book(tmp_path):
    """A scan folder of an opened book."""
    save_scan(shot(False)[0], tmp_path / "book.scan")
    return tmp_path / "book.scan"


def test_the_layout_is_printed_and_nothing_written(book, tmp_path, capsys):
    assert main(["layout", str(book), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["advice"], found["is_spine"]) == ("split", "sure")
    assert found["sigma_mm"] < 0.3
    assert [len(place) for place in found["spine"]] == [2, 2, 2]
    assert found["widths_mm"][0] == pytest.approx(SPINE_MM, abs=0.6)
    assert [path.name for path in tmp_path.iterdir()] == ["book.scan"]
    assert main(["layout", str(book)]) == 0
    assert "layout     split: two leaves" in capsys.readouterr().out


def test_a_missing_scan_is_bad_input(tmp_path, capsys):
    assert main(["layout", str(tmp_path / "none.obj")]) == 3
    assert "none.obj" in capsys.readouterr().err


def test_two_leaves_are_two_pages_with_a_report_each(book, tmp_path):
    out = tmp_path / "out"
    command = ["restore", str(book), "-o", str(out), "--dpi", "50", "--points", "300"]
    assert main([*command, "--layout", "auto"]) == 0
    names = [f"book-{side}.{kind}" for side in ("left", "right") for kind in ("json", "png")]
    assert sorted(path.name for path in out.iterdir()) == names
    report = json.loads((out / "book-left.json").read_text())
    assert (report["part"], report["layout"]["advice"]) == ("left", "split")
    assert main([*command, "--layout", "whole", "--force"]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["book.json", "book.png"]
    assert main([*command, "--layout", "halves", "--force"]) == 2

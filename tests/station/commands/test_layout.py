"""`planish layout` and `planish restore --layout`."""

from __future__ import annotations

import json
import os

import pytest

from oracles.tiny_scan import tiny_scan
from restore import LayoutFinding, PageEdits, save_scan
from restore.formats import write_obj
from restore.mesh.triangulate import triangulate
from station.cli import main
from station.session import Volume, add_scan, correct, create_session, open_session, read_session
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE
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


def test_the_pages_of_a_session_are_listed_with_what_a_hand_decided(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PLANISH_INDEX", str(tmp_path / "sessions.sqlite"))
    create_session(tmp_path / "book", Volume(title="A book"))
    with open_session(tmp_path / "book") as writer:
        restored = add_scan(writer, tiny_scan(1), facts={})
        found = LayoutFinding("ask", "unsure", None, widths_mm=(90.0, 110.0), reasons=("its walls are flat",)).as_json()
        record_run(writer, RESTORE, restored, parameters={}, result={"part": "page", "layout": found})
        correct(writer, 1, PageEdits(layout="split"))
        add_scan(writer, shot(False)[0], facts={})
        events = len(writer.history.events)
    assert main(["layout", str(tmp_path / "book"), "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)
    assert (first["layout"], first["by_hand"]) == (found, "split")
    assert (second["layout"]["advice"], second["by_hand"]) == ("split", "")
    assert main(["layout", str(tmp_path / "book")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].split() == ["1", "ask", "unsure", "90.0", "|", "110.0", "split", "its", "walls", "are", "flat"]
    assert len(read_session(tmp_path / "book").history.events) == events


def test_corrections_next_to_a_scan_are_used(book, tmp_path):
    out = tmp_path / "out"
    command = ["restore", str(book), "-o", str(out), "--dpi", "50", "--points", "300"]
    (tmp_path / "book.edits.json").write_text('{"layout": "left"}')
    assert main(command) == 0
    report = json.loads((out / "book.json").read_text())
    assert (report["part"], report["edits"]) == ("left", {})
    assert main([*command, "--no-edits", "--force"]) == 0
    assert "part" not in json.loads((out / "book.json").read_text())


EVERYTHING = {"what": "remove", "polygon": [[0, 0], [639, 0], [639, 479], [0, 479]]}


@pytest.mark.parametrize(
    ("text", "code", "reason"),
    [
        ('{"layout": "spl', 3, "is not JSON"),
        ('{"version": 99}', 3, "newer Planish"),
        (json.dumps({"scan": "sha512:" + 128 * "0"}), 3, "another scan"),
        (json.dumps({"layout": "whole", "parts": {"page": {"masks": [EVERYTHING]}}}), 5, "leave 0.0%"),
    ],
)
def test_hostile_corrections_change_nothing(tmp_path, capsys, text, code, reason):
    write_obj(triangulate(shot(False)[0]), tmp_path / "book.obj")
    named = tmp_path / "by-hand.json"
    named.write_text(text)
    assert main(["restore", str(tmp_path / "book.obj"), "-o", str(tmp_path / "out"), "--edits", str(named)]) == code
    assert reason in capsys.readouterr().err
    assert list((tmp_path / "out").glob("*")) == []


def test_corrections_that_are_not_a_regular_file_are_refused(book, tmp_path):
    os.mkfifo(tmp_path / "pipe.json")
    for name in ("pipe.json", "gone.json", "book.scan"):
        command = ["restore", str(book), "-o", str(tmp_path / "out"), "--edits", str(tmp_path / name)]
        assert main(command) == 3


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

"""The commands of a station whose scanner is a program: only what is known of it is said."""

from __future__ import annotations

import json

import pytest

from station.cli import main
from tests.drivers.program.conftest import MESH, WRITES
from tests.station.conftest import fault

STATION = """
[scanner]
driver = "program"
capture = ["{python}", "grab.py", "{output}"]
output = "shot.obj"
unit = "cm"
settle_s = 0
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    """The folder of the configuration `station.toml` and of its program."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "grab.py").write_text(WRITES)
    (tmp_path / "station.toml").write_text(STATION)
    return tmp_path


def test_a_scan_is_stored_as_it_came_and_restored(place):
    assert main(["scan", "--config", str(place / "station.toml"), "-o", str(place / "out")]) == 0
    assert (place / "out" / "page.scan" / "shot.obj").read_text() == MESH
    report = json.loads((place / "out" / "page.json").read_text())
    assert sorted(report["page_mm"]) == pytest.approx([800, 1000], abs=1)
    assert report["scan"] == str(place / "out" / "page.scan" / "shot.obj")
    assert report["calibration"] == {"kind": "unknown"}
    assert not list(place.glob("planish-shot-*"))


def test_a_scan_that_cannot_be_restored_is_safe_and_named(place, capsys):
    (place / "grab.py").write_text(WRITES.replace("100 80", "0 80").replace("100 0", "0 0"))
    assert main(["scan", "--config", str(place / "station.toml"), "-o", str(place / "out")]) == 5
    stored = place / "out" / "page.scan" / "shot.obj"
    assert stored.exists()
    assert f"planish restore {stored} --unit cm -o" in fault(capsys.readouterr().err)[-1]


def test_the_doctor_asks_the_scanner_and_wants_no_vivid(place, capsys):
    main(["doctor", "--config", str(place / "station.toml")])
    out = capsys.readouterr().out
    assert "ok        scanner: grab answers" in out
    assert "scsi" not in out.lower()
    assert "calibration" not in out
    with (place / "station.toml").open("a") as file:
        file.write("""check = ["{python}", "-c", "raise SystemExit('no camera')"]""")
    assert main(["doctor", "--config", str(place / "station.toml")]) == 4
    assert "MISSING   scanner: the program ended with code 1: no camera" in capsys.readouterr().out


def test_parking_claims_nothing_of_a_laser(place, capsys):
    assert main(["park", "--config", str(place / "station.toml")]) == 0
    assert capsys.readouterr().out == "scanner: closed; nothing is known of its laser\n"


def test_it_has_no_commands_to_query(place, capsys):
    assert main(["query", "--config", str(place / "station.toml")]) != 0
    assert "sends no commands of its own" in fault(capsys.readouterr().err)[0]

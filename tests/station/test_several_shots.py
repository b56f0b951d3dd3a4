"""Several shots at the station: captured, stored, joined, and told of."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from restore import RangeScan
from restore.formats import load_scan, save_scan
from station.cli import main
from station.run import one_page


@pytest.fixture
def joined(monkeypatch):
    """Stands in for the joining of shots: notes how many there were, and gives the first."""
    calls: list[int] = []

    def super_resolve(shots):
        calls.append(len(shots))
        return replace(shots[0], provenance={"super_resolution": {"captures": len(shots)}})

    monkeypatch.setattr(one_page, "super_resolve", super_resolve)
    return calls


def test_every_shot_is_stored_and_all_are_joined(library, scanner, config_file, tmp_path, joined, capsys):
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out"), "--super-resolution", "4"]) == 0
    stored = sorted(path.name for path in (tmp_path / "out").glob("*.scan"))
    assert stored == ["page-2.scan", "page-3.scan", "page-4.scan", "page.scan"]
    assert joined == [4]
    assert all(isinstance(load_scan(tmp_path / "out" / name), RangeScan) for name in stored)
    assert "page-3.scan" in capsys.readouterr().out


def test_one_shot_is_joined_with_nothing(library, scanner, config_file, tmp_path, joined):
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out")]) == 0
    assert joined == []


def test_a_fault_after_the_shots_shows_how_to_restore_them_all(library, scanner, config_file, tmp_path, joined, capsys):
    library.fault = MemoryError()
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out"), "--super-resolution", "4"]) == 1
    assert capsys.readouterr().err.count("--extra-scan") == 3


def test_stored_shots_are_joined_and_reported(library, scan, scan_file, tmp_path, joined):
    save_scan(scan, tmp_path / "other.scan")
    options = ["--extra-scan", str(tmp_path / "other.scan"), "--extra-scan", str(tmp_path / "other.scan")]
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), *options]) == 0
    assert joined == [3]
    assert len(json.loads((tmp_path / "out" / "book.json").read_text())["extra_scans"]) == 2


def test_too_few_shots_are_a_usage_error(library, scanner, config_file, tmp_path, capsys):
    assert main(["scan", "--config", str(config_file), "-o", str(tmp_path / "out"), "--super-resolution", "3"]) == 2
    assert "--super-resolution" in capsys.readouterr().err


def test_shots_that_do_not_move_are_refused_with_the_reason(library, scan, scan_file, tmp_path, capsys):
    for k in range(3):
        save_scan(scan, tmp_path / f"{k}.scan")
    options = [word for k in range(3) for word in ("--extra-scan", str(tmp_path / f"{k}.scan"))]
    assert main(["restore", str(scan_file), "-o", str(tmp_path / "out"), *options]) == 3
    assert "on each other" in capsys.readouterr().err

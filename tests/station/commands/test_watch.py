"""`planish watch` as it is typed: options, presets, what is printed, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from station.cli import main
from station.run import one_page
from tests.station.conftest import Library

QUICK = ["--once", "--settle", "0", "--pair", "0", "--poll", "0.05"]


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> Library:
    made = Library()
    for name in ("load_capture", "load_scan", "restore"):
        monkeypatch.setattr(one_page, name, getattr(made, name))
    return made


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    folder = tmp_path / "scans"
    (folder / "fine").mkdir(parents=True)
    (folder / "book.wrl").write_bytes(b"1")
    (folder / "fine/map.ply").write_bytes(b"2")
    (folder / "fine/planish.toml").write_text("dpi = 300\n")
    return folder


def test_scans_are_restored_with_their_settings_and_the_report_names_the_original(library, scans, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["watch", str(scans), "-o", str(out), "--dpi", "100", "--tiff", *QUICK]) == 0
    assert sorted(settings.dpi for settings in library.calls) == [100, 300]
    assert (out / "book/book.tif").exists()
    report = json.loads((out / "fine/map/map.json").read_text())
    assert report["scan"] == str(scans / "fine/map.ply")
    assert report["arrival"]["scan"] == "fine/map.ply"
    assert len(report["arrival"]["sha256"]) == 64
    assert capsys.readouterr().out.splitlines() == [
        f"restored   book.wrl: {out / 'book'}",
        f"restored   fine/map.ply: {out / 'fine/map'}",
        "2 restored, 0 set aside",
    ]
    assert main(["watch", str(scans), "-o", str(out), *QUICK]) == 0
    assert len(library.calls) == 2


def test_ctrl_c_ends_it_in_order(library, scans, tmp_path, capsys):
    library.fault = KeyboardInterrupt()
    assert main(["watch", str(scans), "-o", str(tmp_path / "out"), *QUICK]) == 130
    out, err = capsys.readouterr()
    assert out == "0 restored, 0 set aside\n"
    assert "stopped by Ctrl-C" in err
    assert not (tmp_path / "out").exists()


def test_options_are_checked_before_anything_else(library, scans, tmp_path, capsys):
    assert main(["watch", str(scans), "-o", str(tmp_path / "out"), "--dpi", "1", *QUICK]) == 2
    assert main(["watch", str(scans), "-o", str(tmp_path / "out"), "--settle", "inf", "--once"]) == 2
    assert "dpi" in capsys.readouterr().err
    assert main(["watch", str(tmp_path / "nothing"), "-o", str(tmp_path / "out"), *QUICK]) == 2
    assert library.calls == []

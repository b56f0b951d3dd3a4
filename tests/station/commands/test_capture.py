"""`planish capture` as it is typed."""

from __future__ import annotations

import io
import subprocess
import sys

import pytest

import drivers
from restore import load_scan
from station.cli import main
from station.session import read_session, scan_path
from station.session.fixity.verify import verify
from tests.station.conftest import StandInScanner


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert main(["session", "new", str(tmp_path / "book"), "--title", "Missale"]) == 0
    assert main(["session", "new", str(tmp_path / "known"), "--config", "simulated"]) == 0
    return tmp_path


def typed(monkeypatch, keys: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(keys))


def test_what_was_shot_is_stored_restored_and_listed(place, monkeypatch, capsys):
    scanner = StandInScanner()
    monkeypatch.setattr(drivers, "open_scanner", lambda _config: scanner)
    scanner.capture = lambda settings: StandInScanner.capture(scanner, settings, lambda *_: None)
    typed(monkeypatch, " \n")
    assert main(["capture", str(place / "book"), "--config", "simulated"]) == 0
    out = capsys.readouterr().out
    assert "page 1 [1]: stored" in out
    assert "page 1 [1]: accepted" in out
    (page,) = read_session(place / "book").history.pages()
    assert "restore" in page.runs
    assert verify(place / "book").problems == ()
    assert main(["session", "list"]) == 0
    assert "1 pages  Missale" in capsys.readouterr().out


def test_the_station_of_the_session_is_used(place, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr(drivers, "open_scanner", lambda config: opened.append(config["driver"]) or StandInScanner())
    typed(monkeypatch, "?")
    assert main(["capture", "known"]) == 0
    assert opened == ["simulated"]
    assert main(["session", "new", str(place / "other"), "--config", "gone.toml"]) == 2
    assert "the configuration 'gone.toml' does not exist" in capsys.readouterr().err


def test_without_a_scanner_what_is_left_is_done(place, monkeypatch, capsys):
    typed(monkeypatch, " ")
    assert main(["capture", "Missale"]) == 0
    assert "no scanner is configured" in capsys.readouterr().out


def test_a_session_that_is_not_there(place, capsys):
    assert main(["capture", "gone", "--config", "simulated"]) == 3
    assert "session 'gone' does not exist" in capsys.readouterr().err


BOOK = """
[scanner]
driver = "simulated"
[[scanner.book]]
sheet = "flat"
artwork = "white"
page_mm = [200, 90]
table = "none"
[[scanner.book]]
sheet = "flat"
artwork = "text"
page_mm = [200, 150]
table = "none"
[capture]
mode = "fast"
distance_mm = 900
"""


@pytest.mark.slow
def test_a_capture_that_was_killed_goes_on_at_the_right_leaf(place):
    (place / "book.toml").write_text(BOOK)
    command = [sys.executable, "-m", "station", "capture", str(place / "book"), "--config", str(place / "book.toml")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as killed:
        assert killed.stdin is not None
        assert killed.stdout is not None
        killed.stdin.write(" ")
        killed.stdin.flush()
        assert any("stored" in line for line in killed.stdout)
        killed.kill()
    subprocess.run(command, input=" q", text=True, check=True, stdout=subprocess.DEVNULL)
    session = read_session(place / "book")
    pictures = [load_scan(scan_path(session, page.capture)).texture for page in session.history.pages()]
    heights = [int((picture.min(axis=2) > 150).any(axis=1).sum()) for picture in pictures]
    assert len(heights) == 2
    assert heights[1] == pytest.approx(heights[0] * 150 / 90, rel=0.05)

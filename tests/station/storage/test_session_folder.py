"""The folder of a session: known by its files, and closed to every output of a command."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

from station.cli import app, main
from station.errors import UsageError
from station.session import Volume, create_session
from station.storage.session_folder import is_session, refuse_session, session_around
from tests.station.conftest import fault


@pytest.fixture
def session(tmp_path: Path) -> Path:
    create_session(tmp_path / "book", Volume(title="A book"))
    return tmp_path / "book"


def files(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_what_lies_in_a_session_is_found_also_by_a_link(session, tmp_path) -> None:
    (tmp_path / "link").symlink_to(session / "data")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    for path in (session, session / "data", session / "not/there", tmp_path / "link/x"):
        assert session_around(path) == session
    for path in (tmp_path, tmp_path / "book-2", tmp_path / "loop/x", tmp_path / ("x" * 300)):
        assert session_around(path) is None
    assert not is_session(session / "data")


def test_a_session_and_what_lies_in_it_are_distinguished(session) -> None:
    with pytest.raises(UsageError, match=f"{session} is a session$"):
        refuse_session(session)
    with pytest.raises(UsageError, match=f"x lies in the session {session}$"):
        refuse_session(session / "x")


OUTPUTS = [
    ["restore", "SCAN", "-o", "book"],
    ["restore", "SCAN", "-o", "book/.planish-run"],
    ["photos", "SCAN", "-o", "book/out"],
    ["scan", "--config", "simulated", "-o", "book/out"],
    ["merge", "SCAN", "-o", "book/data"],
    ["axis", "--config", "simulated-turntable", "-o", "book"],
    ["demo", "-o", "book"],
    ["ocr", "SCAN", "-o", "book"],
    ["colour", "SCAN", "-o", "book/a.icc"],
    ["board", "-o", "book/a.png"],
    ["calibrate", "SCAN", "-o", "book/a.toml"],
    ["card", "-o", "book/a.pdf"],
    ["patterns", "--projector", "64x64", "-o", "book/out"],
    ["trace", "SCAN", "--draft", "book/a.toml"],
    ["watch", "scans", "-o", "book/out"],
    ["batch", "scans", "-o", "book/out"],
    ["export", "book", "--to", "tiff", "-o", "book/out"],
    ["sheet", "book", "-o", "book/sheet.pdf"],
    ["session", "new", "book/inner"],
    ["session", "list", "--index", "book/sessions.sqlite"],
]


@pytest.mark.parametrize("words", OUTPUTS, ids=lambda words: " ".join(words[:2]))
def test_no_command_writes_into_a_session(session, scan_file, tmp_path, monkeypatch, capsys, words) -> None:
    before = files(session)
    monkeypatch.chdir(tmp_path)
    assert main([word.replace("SCAN", str(scan_file)) for word in words]) == 2
    message, hint = fault(capsys.readouterr().err)
    assert "session" in message
    assert "outside it" in hint
    assert files(session) == before


def test_the_words_of_a_page_in_a_session_do_not_go_there(session, tmp_path, capsys) -> None:
    page = session / "data/page.png"
    page.write_bytes(b"no picture")
    before = files(session)
    assert main(["ocr", str(page)]) == 2
    assert "-o" in fault(capsys.readouterr().err)[1]
    assert files(session) == before


def test_every_command_with_an_output_is_tried() -> None:
    tried = {words[0] for words in OUTPUTS}
    commands = typer.main.get_command(app).commands.items()
    assert {name for name, command in commands if any("-o" in option.opts for option in command.params)} <= tried

"""Every option that a fault names is one of the command that failed; all tests of the station are watched for it."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

from station.cli import app, main
from tests.station.conftest import fault
from tests.station.hints import missing_options, options_of


def test_an_option_of_another_command_is_named_with_its_command() -> None:
    assert "--unit" in options_of(["restore", "scan.obj", "-o", "out"])
    assert missing_options("give it with --unit, or --force", ["restore"]) == []
    assert missing_options("give it with --unit, or --force", ["merge"]) == ["--unit"]
    assert missing_options("take it from a copy with planish repair --from", ["verify"]) == []
    assert missing_options("planish repair --form; --from", ["repair"]) == ["--form"]
    assert missing_options("install it: pip install --force-reinstall x", ["devices"]) == []
    assert missing_options("lower --dpi where the command has it", ["verify"]) == []


def test_every_command_can_be_debugged() -> None:
    groups = [typer.main.get_command(app)]
    groups += [group.commands["session"] for group in groups]
    for name, command in (item for group in groups for item in group.commands.items()):
        assert hasattr(command, "commands") or "--debug" in options_of([name]) | options_of(["session", name])


def unusable_files(place: Path) -> None:
    """Make what INPUTS names in a folder, and nothing that a command can use."""
    (place / "folder").mkdir()
    (place / "empty").touch()
    (place / "empty.toml").touch()
    for suffix in ("obj", "ply", "abs", "png", "pcapng"):
        (place / f"empty.{suffix}").touch()
    (place / "flat.obj").write_text("v 0 0 0\nv 1e9 0 0\nv 0 1e9 0\nf 1 2 3\n")
    (place / "textured.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 0\nvt 0 0\nmtllib no.mtl\nf 1/1 2/1 3/1\n")


INPUTS = ["missing", "folder", "empty", "empty.obj", "empty.ply", "empty.abs", "empty.png", "flat.obj", "textured.obj"]
COMMANDS = [
    ["restore", "IN", "-o", "out"],
    ["photos", "IN", "-o", "out"],
    ["merge", "IN", "-o", "out"],
    ["ocr", "IN", "-o", "out"],
    ["colour", "IN", "-o", "out.icc"],
    ["calibrate", "IN", "-o", "out.toml"],
    ["trace", "IN"],
    ["scan", "--config", "IN", "-o", "out"],
    ["axis", "--config", "IN", "-o", "out"],
    ["query", "--config", "IN"],
    ["park", "--config", "IN"],
    ["batch", "IN", "-o", "out"],
    ["watch", "IN", "-o", "out", "--once", "--settle", "0", "--pair", "0"],
    ["export", "IN", "--to", "tiff", "-o", "out"],
    ["session", "show", "IN"],
    ["session", "recover", "IN"],
    ["session", "add", "IN", "empty.obj"],
    ["session", "undo", "IN"],
    ["verify", "IN"],
    ["repair", "IN"],
    ["reproduce", "IN"],
    ["reindex", "IN"],
    ["capture", "IN"],
]


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that the commands run in; the index of sessions lies there, too."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.chdir(tmp_path)
    unusable_files(tmp_path)
    return tmp_path


@pytest.mark.parametrize("words", COMMANDS, ids=lambda words: " ".join(words[:2]))
def test_a_command_says_what_is_wrong_with_an_input_and_names_its_own_options(place, capsys, words) -> None:
    for name in INPUTS:
        code = main([name if word == "IN" else word for word in words])
        out, err = capsys.readouterr()
        assert code in (0, 2, 3, 4, 5), (name, err)
        if code:
            message, *hints = fault(err[err.index("planish: ") :])
            assert message, name
            assert hints, (name, message)
        assert "unexpected" not in err, (name, err)
        assert ".planish-run" not in out + err, name

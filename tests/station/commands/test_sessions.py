"""`planish session`, `verify`, `repair`, `reproduce` and `reindex` as they are typed."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from restore import save_scan
from station.cli import main
from station.run.small_page import small_page
from station.session import open_session, read_session


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a session of two pages; the index lies there too."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.chdir(tmp_path)
    save_scan(small_page(), tmp_path / "a.scan")
    assert main(["session", "new", "book", "--title", "Missale", "--project", "P", "--preset", "leaflet"]) == 0
    assert main(["session", "add", "book", "a.scan", "a.scan"]) == 0
    return tmp_path


def test_a_session_is_made_filled_and_shown(place, capsys):
    assert main(["session", "set", "Missale", "2", "--note", "torn", "--mark", "--side", "left", "--accept"]) == 0
    capsys.readouterr()
    assert main(["session", "show", "book"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "Missale  P",
        "book, 2 pages, 7 events, preset leaflet",
        "    page  label    side   state     level  kind     edited note",
        "       1  1r              new",
        "       2  1v       left   accepted                         * torn",
        "undo: accept of page 2",
    ]
    assert main(["session", "show", "book", "--json"]) == 0
    pages = json.loads(capsys.readouterr().out)["pages"]
    assert [(page["label"], page["state"], page["mark"]) for page in pages] == [
        ("1r", "new", False),
        ("1v", "accepted", True),
    ]


def test_decisions_and_shots_are_undone_and_redone(place, capsys):
    main(["session", "set", "book", "1", "--label", "x"])
    capsys.readouterr()
    assert main(["session", "undo", "book"]) == 0
    assert main(["session", "undo", "book"]) == 0
    assert len(list(read_session(place / "book").history.pages())) == 1
    assert main(["session", "redo", "book"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "undone: label of page 1, event 4",
        "undone: capture of page 2, event 3",
        "brought back: capture of page 2, event 3",
    ]
    assert main(["session", "redo", "book"]) == 0
    assert main(["session", "redo", "book"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "nothing to redo"


def test_the_index_is_rebuilt_from_the_folders_alone(place, capsys):
    main(["session", "list", "--json"])
    before = json.loads(capsys.readouterr().out)
    assert [entry["title"] for entry in before] == ["Missale"]
    shutil.rmtree(place / "data")
    assert main(["session", "list"]) == 0
    assert "no sessions" in capsys.readouterr().out
    assert main(["reindex", str(place)]) == 0
    assert capsys.readouterr().out == "1 sessions\n"
    main(["session", "list", "--json"])
    assert json.loads(capsys.readouterr().out) == before


def test_a_folder_that_is_not_there_empties_no_index(place, capsys):
    capsys.readouterr()
    assert main(["reindex", str(place / "share")]) == 3
    assert f"the folder {place / 'share'} does not exist" in capsys.readouterr().err
    assert main(["session", "show", "Missale"]) == 0


def test_a_session_that_was_moved_is_entered_by_opening_it(place, capsys):
    shutil.move(place / "book", place / "elsewhere")
    assert main(["session", "recover", "elsewhere"]) == 0
    capsys.readouterr()
    assert main(["session", "list", "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)
    assert entry["folder"] == str(place / "elsewhere")


def test_a_session_that_is_gone_is_reported_and_listed_so(place, capsys):
    shutil.move(place / "book", place / "elsewhere")
    capsys.readouterr()
    for words in (["session", "show"], ["verify"], ["export", "--to", "tiff", "-o", "out"]):
        assert main([*words, "Missale"]) == 3
        assert f"planish session recover {place / 'elsewhere'}" in capsys.readouterr().err
    assert main(["session", "list"]) == 0
    assert capsys.readouterr().out.endswith(f"{place / 'book'}  (gone)\n")
    assert main(["reindex"]) == 0
    assert "planish reindex FOLDER enters it" in capsys.readouterr().err


def test_damage_is_reported_and_repaired(place, capsys):
    record = place / "book/data/0002-000003-capture/event.json"
    record.chmod(0o644)
    record.write_bytes(b"x" + record.read_bytes())
    capsys.readouterr()
    assert main(["verify", "book"]) == 6
    out, err = capsys.readouterr()
    assert out.startswith("page 2: data/0002-000003-capture/event.json is not the file that was written")
    assert "on pages 2" in err
    assert main(["repair", "book"]) == 0
    assert main(["verify", "book"]) == 0
    assert "all files are as they were written" in capsys.readouterr().out


def test_damage_that_only_a_copy_can_repair(place, capsys):
    shutil.copytree(place / "book", place / "copy")
    for path in place.glob("book/data/*/original/a.scan/texture.png"):
        path.unlink()
    assert main(["repair", "book"]) == 6
    assert "--from" in capsys.readouterr().err
    assert main(["repair", "book", "--from", "copy"]) == 0
    assert main(["verify", "book"]) == 0


def test_a_session_without_runs_replays(place, capsys):
    assert main(["reproduce", "book"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "0 runs, all equal"


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["show", "nothing"], 3, "the session 'nothing' does not exist"),
        (["add", "book", "book/events.jsonl"], 3, "not a scan file"),
        (["add", "book", "a.scan", "gone.obj"], 3, "gone.obj does not exist"),
        (["add", "book", "a.scan", "book/events.jsonl"], 3, "not a scan file"),
        (["add", "book", "gone.obj", "--photos"], 3, "gone.obj is not there"),
        (["add", "book", "a.scan", "book", "--photos"], 3, "a.scan is not a file"),
        (["add", "book", "a.scan", "a.scan", "--page", "1"], 2, "cannot be one page"),
        (["set", "book", "9", "--label", "x"], 2, "has no page 9"),
        (["undo", "book", "--page", "9", "--stage", "verdict"], 2, "has no page 9"),
        (["undo", "book", "--page", "1", "--stage", "restored"], 2, "the stages are restore, verdict"),
        (["redo", "book", "--page", "1", "--stage", "x"], 2, "the stage 'x' does not exist"),
        (["new", "book"], 2, "is there already"),
        (["set", "book", "1"], 2, "there is nothing to set"),
        (["set", "book", "0", "--accept"], 2, "the volume itself is not accepted"),
        (["set", "book", "1", "--note", os.fsdecode(b"M\xfcller")], 3, "is not text in UTF-8"),
        (["add", "book", "."], 3, ". is not a scan folder"),
        (["set", "book", "1", "--label", "x", "--position", "nan"], 2, "--position: nan is not a place"),
        (["set", "book", "1", "--position", "-inf"], 2, "--position: -inf is not a place"),
        (["new", "other", "--title", "x" * 5000], 2, "--title: has 5000 characters, 500 are the most"),
        (["new", "other", "--project", "x" * 1001], 2, "--project: has 1001 characters, 500 are the most"),
        (["new", "other", "--title", " \t"], 2, "--title: the title is blank"),
        (["new", "other", "--preset", "none"], 2, "the preset 'none' does not exist"),
    ],
)
def test_what_cannot_be_is_refused(place, capsys, words, code, text):
    assert main(["session", *words]) == code
    assert text in capsys.readouterr().err
    assert len(read_session(place / "book").history.events) == 3
    assert not (place / "other").exists()


def test_a_scan_below_a_path_that_is_not_utf8_is_added(place, capsys):
    folder = place / os.fsdecode(b"M\xfcller")
    folder.mkdir()
    shutil.move(place / "a.scan", folder / "a.scan")
    assert main(["session", "add", "book", str(folder / "a.scan")]) == 0
    event = read_session(place / "book").history.events[-1]
    assert event.facts["from"].endswith("M\\xfcller/a.scan")
    assert main(["verify", "book"]) == 0


def test_the_next_command_is_reported_as_it_is_typed(place, capsys):
    capsys.readouterr()
    assert main(["session", "new", "a book"]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == "capture its pages with: planish capture 'a book'"


def test_a_second_writer_is_shown_who_holds_the_session(place, capsys):
    with open_session(place / "book"):
        assert main(["session", "undo", "book"]) == 2
        assert "in use by another run" in capsys.readouterr().err
        assert main(["session", "show", "book"]) == 0


def test_a_path_that_is_not_utf8_hinders_no_step(place, capsys):
    name = os.fsdecode(b"M\xfcller")
    for words in (["new", name], ["add", name, "a.scan"], ["set", name, "1", "--label", "x"], ["recover", name]):
        assert main(["session", *words]) == 0
        assert "the index was not updated: the path" in capsys.readouterr().err
    session = read_session(place / name)
    assert (session.volume.title, session.history.page(1).decided.label) == ("M\N{REPLACEMENT CHARACTER}ller", "x")
    assert main(["reindex", str(place)]) == 0
    out, err = capsys.readouterr()
    assert "skipped: the path" in err
    assert out == "1 sessions\n"


def test_an_index_that_cannot_be_written_hinders_no_step(place, capsys):
    shutil.rmtree(place / "data")
    (place / "data").write_text("a file in its place")
    assert main(["session", "set", "book", "1", "--label", "x"]) == 0
    assert "the index was not updated" in capsys.readouterr().err
    assert read_session(place / "book").history.page(1).decided.label == "x"

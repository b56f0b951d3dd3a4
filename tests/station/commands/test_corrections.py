"""`planish session edits | apply | order | labels`: what they record, what they print, what they refuse."""

from __future__ import annotations

import json
from contextlib import contextmanager

import pytest

from oracles.tiny_scan import tiny_scan
from restore import PageEdits
from station.cli import main
from station.commands import about, corrections, sessions
from station.session import Volume, add_rule, add_scan, correct, create_session, open_session, read_session
from station.session.corrections.layers import effective_edits, own_edits
from station.session.leaves.leaf import leaves_of
from station.session.log.steps import record_run
from station.session.operations.arrangement import change_leaf, mark_missing, move_leaves
from station.session.operations.description import describe
from station.session.terms.about import About
from station.session.terms.parts import RESTORE
from station.session.terms.rules import Scope

SPLIT = {"parts": {"left": {}, "right": {}}}


@pytest.fixture
def book(tmp_path, monkeypatch):
    """A session of a cover, two openings and a last page, outside any index of ours."""
    monkeypatch.setenv("PLANISH_INDEX", str(tmp_path / "sessions.sqlite"))
    create_session(tmp_path / "book", Volume(title="A book"))
    with open_session(tmp_path / "book") as writer:
        for seed, result in enumerate([{}, SPLIT, SPLIT, {}]):
            capture = add_scan(writer, tiny_scan(seed), facts={})
            record_run(writer, RESTORE, capture, parameters={}, result=result)
    return tmp_path / "book"


def run(*words):
    return main(["session", *map(str, words)])


def events(book):
    return len(read_session(book).history.events)


def edits_of_page(book, number):
    session = read_session(book)
    return effective_edits(session, session.history.page(number))


def labels(book):
    return [leaf.label for leaf in leaves_of(read_session(book))]


def test_fields_of_one_leaf_with_the_name_of_the_operator(book, capsys):
    before = events(book)
    assert (
        run("edits", book, "2/left", "--set", "turn=1", "--set", "layout=split", "--operator", "A. B.", "--json") == 0
    )
    shown = json.loads(capsys.readouterr().out)
    assert shown["edits"] == {"layout": "split", "parts": {"left": {"turn": 1}}}
    assert shown["outdated"] is True
    assert events(book) == before + 1
    session = read_session(book)
    restored = session.history.page(2).runs[RESTORE].number
    assert own_edits(session, session.history.page(2)).given()["by"] == {
        "operator": "A. B.",
        "tool": "cli",
        "saw": restored,
    }
    assert run("edits", book, "2", "--set", "rotate=0.5") == 0
    assert edits_of_page(book, 2)["parts"] == {"left": {"turn": 1, "rotate_deg": 0.5}, "right": {"rotate_deg": 0.5}}
    assert run("edits", book, "2", "--clear") == 0
    assert edits_of_page(book, 2) is None
    assert run("undo", book) == 0
    assert edits_of_page(book, 2)["parts"]["left"]["turn"] == 1


def test_a_rule_names_its_pages_and_those_that_keep_their_own(book, capsys):
    run("edits", book, "3", "--set", "turn=2")
    before = events(book)
    assert run("apply", book, "turn=1", "--to", "following:2", "--dry-run") == 0
    assert events(book) == before
    capsys.readouterr()
    assert run("apply", book, "turn=1", "--to", "following:2", "--json") == 0
    shown = json.loads(capsys.readouterr().out)
    assert (shown["pages"], shown["own_corrections"]) == ([2, 3, 4], {"3": ["left.turn", "right.turn"]})
    assert events(book) == before + 1
    turns = [(edits_of_page(book, number) or {}).get("parts", {}).get("left", {}).get("turn") for number in (1, 2, 3)]
    assert turns == [None, 1, 2]
    assert run("apply", book, "rotate=1.5", "--to", "right", "--future") == 0
    assert edits_of_page(book, 2)["parts"]["right"] == {"turn": 1, "rotate_deg": 1.5}
    assert "rotate_deg" not in edits_of_page(book, 2)["parts"]["left"]


def test_the_exported_file_is_imported_to_the_byte(book, tmp_path):
    run("edits", book, "2/right", "--set", "turn=1", "--set", "remove=0,0:5,0:5,5")
    assert run("edits", book, "2", "--export", tmp_path / "a.edits.json") == 0
    assert run("edits", book, "2", "--export", tmp_path / "a.edits.json") == 2
    effective = edits_of_page(book, 2)
    run("edits", book, "2", "--clear")
    assert run("edits", book, "2", "--import", tmp_path / "a.edits.json") == 0
    assert edits_of_page(book, 2) == effective
    assert run("edits", book, "3", "--import", tmp_path / "a.edits.json") == 3
    assert run("edits", book, "3", "--import", tmp_path / "a.edits.json", "--edits-of-another") == 0
    assert edits_of_page(book, 3) == effective


def test_an_imported_label_is_that_of_the_leaf(book, tmp_path):
    (tmp_path / "a.json").write_text('{"parts": {"left": {"label": "xii"}}}')
    assert run("edits", book, "2", "--import", tmp_path / "a.json") == 0
    assert labels(book) == ["1", "xii", "3", "4", "5", "6"]


@pytest.mark.parametrize(
    "text",
    [
        '{"layout": "split"',
        "[" * 30_000,
        '{"parts": {"page": {"rotate_deg": NaN}}}',
        '{"parts": {"page": {"outline": [' + ",".join(["[1.0,2.0]"] * 30_000) + "]}}}",
        '{"overlap_mm": "1"}',
        '{"version": 99}',
        '{"colour": "red"}',
    ],
    ids=["cut off", "nested", "NaN", "many points", "text", "version", "unknown"],
)
def test_hostile_files_end_with_3_and_change_nothing(book, tmp_path, text):
    (tmp_path / "a.json").write_text(text)
    before = events(book)
    assert run("edits", book, "2", "--import", tmp_path / "a.json") == 3
    assert events(book) == before


@pytest.mark.parametrize(
    "words",
    [
        ("edits", "9", "--set", "turn=1"),
        ("edits", "2/middle"),
        ("edits", "2", "--set", "turn=1", "--clear"),
        ("edits", "2", "--set", "colour=red"),
        ("apply", "spine=1,2:1,9", "--to", "all"),
        ("apply", "layout=whole", "--to", "left"),
        ("apply", "turn=1", "--to", "7-9"),
        ("apply", "turn=1", "--to", "some"),
        ("order", "--move", "2"),
        ("order", "--move", "2", "--before", "2/left"),
        ("order", "--leave-out", "9"),
        ("labels", "--run", "from=9 style=folio"),
        ("labels", "--run", "style=greek"),
    ],
    ids=" ".join,
)
def test_wrong_options_end_with_2_and_change_nothing(book, words):
    before = events(book)
    assert run(words[0], book, *words[1:]) == 2
    assert events(book) == before


def test_leaves_move_are_left_out_and_put_back(book):
    names = lambda: [leaf.name for leaf in leaves_of(read_session(book)) if not leaf.is_left_out]  # noqa: E731
    assert run("order", book, "--move", "4", "--before", "2") == 0
    assert names() == ["1", "4", "2/left", "2/right", "3/left", "3/right"]
    assert run("order", book, "--leave-out", "3/left") == 0
    assert names() == ["1", "4", "2/left", "2/right", "3/right"]
    assert labels(book) == ["1", "2", "3", "4", "", "5"]
    assert run("order", book, "--put-back", "3/left") == 0
    assert run("undo", book) == 0
    assert run("undo", book) == 0
    assert run("undo", book) == 0
    assert names() == ["1", "2/left", "2/right", "3/left", "3/right", "4"]


def test_runs_of_labels_and_a_leaf_that_is_missing(book, capsys):
    run("edits", book, "1", "--set", "kind=cover")
    assert run("labels", book, "--run", "from=2/left style=roman", "--run", "from=3/left style=folio side=verso") == 0
    assert labels(book) == ["", "i", "ii", "1v", "2r", "2v"]
    assert run("order", book, "--missing-before", "4", "--label", "2v") == 0
    assert labels(book)[-1] == "3r"
    capsys.readouterr()
    assert run("labels", book, "--list") == 0
    shown = capsys.readouterr().out
    assert "run        from=2/left style=roman" in shown
    assert "missing   2v" in shown
    assert run("labels", book, "--clear") == 0
    assert labels(book) == ["", "1", "2", "3", "4", "6"]


MEANWHILE = {
    ("edits", "2", "--set", "turn=1"): lambda writer: correct(writer, 2, PageEdits(kind="leaf")),
    ("edits", "2", "--clear"): lambda writer: add_scan(writer, tiny_scan(9), page=2, facts={}),
    ("apply", "turn=1", "--to", "all"): lambda writer: add_rule(writer, Scope(), PageEdits(kind="leaf")),
    ("order", "--move", "4", "--before", "1"): lambda writer: move_leaves(writer, ["1"], None),
    ("order", "--leave-out", "4"): lambda writer: change_leaf(writer, "4", label="x"),
    ("order", "--missing-before", "4", "--label", "3"): lambda writer: mark_missing(writer, "4", ["2"]),
    ("labels", "--run", "from=4"): lambda writer: move_leaves(writer, ["1"], None),
    ("about", "--set", "title=A"): lambda writer: describe(writer, About(title="B")),
}


@pytest.mark.parametrize(("words", "change"), MEANWHILE.items(), ids=map(" ".join, MEANWHILE))
def test_a_change_of_what_another_program_changed_meanwhile_is_refused(book, monkeypatch, capsys, words, change):
    """It comes after the session was read, and before it is opened for writing."""
    opened = sessions.writing

    @contextmanager
    def after_another(index, name):
        with open_session(book) as writer:
            assert change(writer) is not None
        with opened(index, name) as writer:
            yield writer

    for module in (about, corrections):
        monkeypatch.setattr(module, "writing", after_another)
    before = events(book)
    assert run(words[0], book, *words[1:]) == 1
    assert "meanwhile" in capsys.readouterr().err
    assert events(book) == before + 1


def test_the_words_of_an_operator_are_checked(book):
    before = events(book)
    assert run("order", book, "--missing-before", "4", "--label", "\x1b]0;x\x07") == 2
    assert run("edits", book, "2", "--set", "turn=1", "--operator", "\x1b]0;x\x07") == 2
    assert run("apply", book, "turn=1", "--to", "all", "--operator", "\x1b]0;x\x07") == 2
    assert events(book) == before

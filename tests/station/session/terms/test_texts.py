"""What an operator writes, and what a terminal is shown of it."""

from __future__ import annotations

import pytest

from station.commands.terminal import print_result
from station.errors import UsageError
from station.session import Volume, create_session
from station.session.terms.texts import check_text


def test_texts_are_taken_without_the_blanks_around_them():
    assert check_text("label", " 12r ä ") == "12r ä"
    assert check_text("note", "one\r\ntwo\tthree\n") == "one\ntwo\tthree"


@pytest.mark.parametrize(
    ("name", "text"), [("label", "1\n2"), ("note", "\x1b[31m"), ("title", "a\x85b"), ("side", "\u2028x")]
)
def test_control_characters_are_refused(name, text):
    with pytest.raises(UsageError, match="control character"):
        check_text(name, text)


def test_a_title_has_none(tmp_path):
    with pytest.raises(UsageError, match="title"):
        create_session(tmp_path / "s", Volume(title="\x1b]0;x\x07"))
    assert not (tmp_path / "s").exists()


def test_a_terminal_is_never_sent_one(capsys):
    """A label or a file's name of somebody else does not move the cursor, nor set the window's title."""
    print_result("page 1  \x1b]0;owned\x07\x9b31m\tdone\r\n")
    assert capsys.readouterr().out == "page 1  \\x1b]0;owned\\x07\\x9b31m\tdone\\x0d\n\n"

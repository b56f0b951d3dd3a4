"""The reference of the commands is what their definitions say: `python -m bench.reference --write-docs`."""

from oracles.command_reference import PAGE, command_reference
from tests.test_documented_commands import ROOT_COMMAND, mistake

TEXT = command_reference()


def test_the_page_is_what_the_commands_say():
    assert PAGE.read_text("utf-8") == TEXT


def test_every_command_has_a_section_with_a_usage_that_exists():
    def names(command, path):
        inner = getattr(command, "commands", None)
        return [path] if inner is None else [one for name in inner for one in names(inner[name], f"{path} {name}")]

    shown = [line.removeprefix("### ") for line in TEXT.splitlines() if line.startswith("### ")]
    assert sorted(shown) == sorted(names(ROOT_COMMAND, "planish"))
    assert [mistake(f"{one} --help") for one in shown] == [None] * len(shown)


def test_the_page_does_not_depend_on_the_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    assert command_reference() == TEXT

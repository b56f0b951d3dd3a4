"""Every command that a document shows exists: of Planish with its options, of the benches, of make."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
import typer

from station.cli import app

ROOT = Path(__file__).parents[1]
DOCUMENTS = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
FENCED = re.compile(r"^```[^\n]*\n(.*?)^```", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"^ {4,}(\S.*)$", re.MULTILINE)
SPAN = re.compile(r"`([^`\n]+)`")
COMMAND = re.compile(r"^(?:\$ |sudo |\S*/bin/)?(planish(?: .*)?)$", re.MULTILINE)
COMMENT = re.compile(r"\s{3,}\S.*$|\s+#.*$")  # what a table of commands says of each
ROOT_COMMAND = typer.main.get_command(app)


def shown_commands(text: str) -> list[str]:
    """Command lines in the blocks and code spans of a document, without what is said of them."""
    blocks = [*FENCED.findall(text), *INDENTED.findall(text), *SPAN.findall(FENCED.sub("", text))]
    return [COMMENT.sub("", line) for block in blocks for line in COMMAND.findall(block)]


def mistake(line: str) -> str | None:
    """What is wrong with a command line: a command or an option that does not exist; None if nothing is."""
    command, words = ROOT_COMMAND, shlex.split(re.sub(r"[\[\]…<>;,']", " ", line))[1:]
    while hasattr(command, "commands") and words and not words[0].startswith("-"):
        known = command.commands.get(words[0].rstrip(".,:"))
        if known is None:
            return f"no command {words[0]!r}"
        command, words = known, words[1:]
    options = {"--help"}.union(*((*one.opts, *one.secondary_opts) for one in command.params))
    given = [word.split("=")[0].split("|")[0] for word in words if re.match(r"--?[a-z]", word)]
    return next((f"no option {word}" for word in given if word not in options), None)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_command_exists(document: Path) -> None:
    lines = shown_commands(document.read_text("utf-8"))
    assert [(line, wrong) for line in lines if (wrong := mistake(line))] == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_bench_and_target_exists(document: Path) -> None:
    text = document.read_text("utf-8")
    benches = {name.replace(".", "/") for name in re.findall(r"python -m (bench\.[a-z_.]*[a-z])", text)}
    assert {
        name for name in benches if not list(ROOT.glob(f"{name}.py")) + list(ROOT.glob(f"{name}/__main__.py"))
    } == set()
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    shown = re.findall(r"(?:`|^ *)make ([a-z-]+)(?:`| {2}|$)", text, re.MULTILINE)
    assert set(shown) <= set(targets)


def test_wrong_commands_are_found() -> None:
    text = "```\nplanish demo -o OUT     says what\n$ planish scan --speed 3\n```\n`planish fly`\n    planish ocr A\n"
    assert [mistake(line) for line in shown_commands(text)] == [None, "no option --speed", None, "no command 'fly'"]

"""The page with the reference of the commands, out of their own definitions."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html import escape
from typing import Any

import typer
from typer._click import Context

from oracles import ROOT
from station.cli import app

PAGE = ROOT / "docs" / "reference" / "cli.md"
HEAD = """# Commands

Written by `python -m bench.reference --write-docs` from the commands' own definitions. Every command has the options
`--quiet`, `--verbose` and `--help`; [exit codes](file-formats.md#exit-codes) are listed with the file formats.
"""
COMMON = {"quiet", "verbose", "help"}


def command_reference() -> str:
    """Return the page: commands by their group, each with its arguments and options."""
    root = Context(typer.main.get_command(app), info_name="planish")
    groups: dict[str, list[str]] = {}
    for context in _commands(root):
        panel = _panel(context)
        groups.setdefault(panel, []).append(_section(context))
    return HEAD + "".join(f"\n## {title}\n{''.join(sections)}" for title, sections in groups.items())


def _commands(parent: Context) -> Iterator[Context]:
    """Yield the context of every command that is not a group, in the order of the help."""
    command: Any = parent.command
    for name in command.list_commands(parent):
        inner = Context(command.get_command(parent, name), info_name=name, parent=parent)
        if hasattr(inner.command, "commands"):
            yield from _commands(inner)
        elif not inner.command.hidden:
            yield inner


def _panel(context: Context) -> str:
    """Return the group that a command is listed in, that of its parent where it has none."""
    panel = getattr(context.command, "rich_help_panel", None)
    if isinstance(panel, str):
        return panel
    return _panel(context.parent) if context.parent is not None else "Commands"


def _section(context: Context) -> str:
    """Return a heading, the description, the usage, and a table of arguments and options."""
    command: Any = context.command
    usage = command.get_usage(context).removeprefix("Usage: ")
    rows = [record for one in command.params if one.name not in COMMON and (record := one.get_help_record(context))]
    lines = [f"| `{_cell(names)}` | {escape(_cell(meaning), quote=False)} |" for names, meaning in rows]
    table = ["| argument or option | meaning |", "|---|---|", *lines]
    parts = [f"### {context.command_path}", str(command.help or "").strip(), f"    {' '.join(usage.split())}"]
    return "\n" + "\n\n".join([*parts, *(["\n".join(table)] if rows else [])]) + "\n"


def _cell(text: str) -> str:
    """Return a text for a cell of a table, on one line; choices are separated by commas, since a bar ends a cell."""
    return re.sub(r"\s+", " ", text).replace("|", ", ")

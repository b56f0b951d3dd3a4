"""How the commands are listed, and the options that every one of them has."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from station.progress import Verbosity, verbosity

if TYPE_CHECKING:
    from typer._click import Command, Context, HelpFormatter

OTHERS = "Commands"  # title of a list without groups

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print results and errors only.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Print each stage when it begins.")]


class CommandGroups(TyperGroup):
    """Commands listed by the panel that each was added to.

    Groups of commands first, with descriptions uncut.
    """

    def get_command(self, ctx: Context, cmd_name: str) -> Command | None:
        """Return a command with its description as its short help, which shells show uncut."""
        command = super().get_command(ctx, cmd_name)
        if command is not None and not command.short_help:
            command.short_help = _description(command)
        return command

    def format_commands(self, ctx: Context, formatter: HelpFormatter) -> None:
        """Write a section for each panel, in the order of the commands."""
        sections: dict[str, list[tuple[str, str]]] = {}
        for name in self.list_commands(ctx):
            command = self.get_command(ctx, name)
            if command is not None and not command.hidden:
                panel = getattr(command, "rich_help_panel", None)
                rows = sections.setdefault(panel if isinstance(panel, str) else OTHERS, [])
                rows.insert(0 if isinstance(command, TyperGroup) else len(rows), (name, str(command.short_help)))
        for title, rows in sections.items():
            with formatter.section(title):
                formatter.write_dl(rows)


def _description(command: Any) -> str:
    """The first line of a command's help."""
    return str(command.help or "").strip().partition("\n")[0]


def with_verbosity(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with the options --quiet and --verbose.

    They hold while it runs.
    """

    @wraps(command)
    def speaking(*, quiet: bool, verbose: bool, **values: Any) -> None:
        level = Verbosity.QUIET if quiet else Verbosity.VERBOSE if verbose else Verbosity.NORMAL
        before = verbosity.set(level)
        try:
            command(**values)
        finally:
            verbosity.reset(before)

    plain = inspect.signature(command, eval_str=True)
    keyword = inspect.Parameter.KEYWORD_ONLY
    added = [
        inspect.Parameter("quiet", keyword, default=False, annotation=Quiet),
        inspect.Parameter("verbose", keyword, default=False, annotation=Verbose),
    ]
    parameters = [*(one.replace(kind=keyword) for one in plain.parameters.values()), *added]
    speaking.__signature__ = plain.replace(parameters=parameters)  # type: ignore[attr-defined]
    speaking.__annotations__ = {one.name: one.annotation for one in parameters}
    return speaking

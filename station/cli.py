"""The command `planish`: the list of its commands, and `main`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from station.commands.about import about
from station.commands.batch import batch
from station.commands.calibrate import axis, board, calibrate
from station.commands.capture import capture
from station.commands.card import card
from station.commands.compile import compile_command
from station.commands.corrections import apply, edits, labels, order
from station.commands.demo import demo
from station.commands.devices import devices
from station.commands.doctor import doctor
from station.commands.export import export
from station.commands.groups import CommandGroups, with_verbosity
from station.commands.layout import layout
from station.commands.page import merge, photos, restore, scan
from station.commands.park import park
from station.commands.patterns import patterns
from station.commands.preservation import reindex, repair, reproduce, verify
from station.commands.query import query
from station.commands.reading import colour, ocr
from station.commands.serve import serve
from station.commands.sessions import app as sessions
from station.commands.sheet import sheet
from station.commands.terminal import (
    READER_GONE,
    CommandLineError,
    occupy_standard_streams,
    print_fault,
    print_result,
    report_faults,
    usage_fault,
)
from station.commands.trace import trace
from station.commands.watch import watch
from station.errors import USAGE, UsageError, explain
from station.version import software_version

# Commands import what they need inside: it takes seconds, and `--help` answers at once.
app = typer.Typer(cls=CommandGroups, invoke_without_command=True, pretty_exceptions_enable=False, rich_markup_mode=None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command with the given arguments, or those of the process.

    arguments: None for those of the process.
    Returns the exit code.
    """
    occupy_standard_streams()
    try:
        code = app(None if arguments is None else list(arguments), prog_name="planish", standalone_mode=False)
    except SystemExit as end:  # typer ends so when the reader of its help is gone
        return READER_GONE if isinstance(end.__context__, BrokenPipeError) else int(end.code or 0)
    except UsageError as error:  # of an option, before its command begins
        print_fault(explain(error))
        return USAGE
    except Exception as error:
        if not isinstance(error, CommandLineError):
            raise
        print_fault(usage_fault(error))
        return USAGE
    return int(code or 0)


@app.callback()
def _planish(
    context: typer.Context, version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False
) -> None:
    """Turn a 3D scan of a warped page into the flat page it once was."""
    if version or context.invoked_subcommand is None:
        with report_faults():
            print_result(software_version() if version else context.get_help())
        raise typer.Exit(0 if version else USAGE)


COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    "Start here": {"demo": demo, "doctor": doctor},
    "One page": {"scan": scan, "restore": restore, "layout": layout, "photos": photos, "merge": merge, "ocr": ocr},
    "Volumes": {"capture": capture, "batch": batch, "watch": watch, "serve": serve, "export": export, "sheet": sheet},
    "Preservation": {"verify": verify, "repair": repair, "reproduce": reproduce, "reindex": reindex},
    "Calibration": {
        "board": board,
        "calibrate": calibrate,
        "axis": axis,
        "card": card,
        "patterns": patterns,
        "colour": colour,
    },
    "Scanner": {"devices": devices, "query": query, "park": park, "trace": trace},
    "Maintenance": {"compile": compile_command},
}
SESSION_COMMANDS: dict[str, Callable[..., None]] = {
    "edits": edits,
    "apply": apply,
    "order": order,
    "labels": labels,
    "about": about,
}
for name, command in SESSION_COMMANDS.items():
    sessions.command(name)(with_verbosity(command))
for panel, commands in COMMANDS.items():
    for name, command in commands.items():
        app.command(name, rich_help_panel=panel)(with_verbosity(command))
app.add_typer(sessions, name="session", rich_help_panel="Volumes")

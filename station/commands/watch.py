"""The command `planish watch`."""

from __future__ import annotations

import json
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import (
    MAX_S,
    Debug,
    FileReading,
    Json,
    Kinds,
    Out,
    Restoration,
    grouped,
    reading_options,
    run_options,
)
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on

if TYPE_CHECKING:
    from station.intake.loop import Event, Watch

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The folder in which scans arrive.", show_default=False)]
Once = Annotated[bool, typer.Option("--once", help="End when all present scans are done.")]
Settle = Annotated[
    float, typer.Option(min=0, max=MAX_S, metavar="S", help="Seconds without change after which a file is complete.")
]
Pair = Annotated[
    float, typer.Option(min=0, max=MAX_S, metavar="S", help="Seconds to wait for the image and material of a mesh.")
]
Poll = Annotated[
    float, typer.Option(min=0.05, max=MAX_S, metavar="S", help="Seconds between two listings of the folder.")
]


@grouped
def watch(
    folder: Folder,
    output: Out,
    chosen: Restoration,
    kinds: Kinds,
    reading: FileReading,
    once: Once = False,
    settle: Settle = 3.0,
    pair: Pair = 30.0,
    poll: Poll = 1.0,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Restore every scan that arrives in a folder.

    Runs until Ctrl-C. A file planish.toml in a sub-folder sets the options of the scans there.
    """
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.intake.loop import Pace, Watch
        from station.intake.presets import Presets
        from station.run.one_page import restore_file

        folder, output = folder.resolve(), output.resolve()
        options = run_options("watch", kinds, chosen, **reading_options(reading))
        watching = Watch(
            folder,
            output,
            Presets(folder, options),
            partial(restore_file, progress=progress),
            _print_json if as_json else _print_event,
            Pace(poll, settle, pair),
            once=once,
        )
        try:
            watching.run()
        finally:
            print_result(json.dumps({"counts": dict(watching.counts)}) if as_json else _summary(watching))


def _print_event(event: Event, scan: Path, text: str) -> None:
    print_result(f"{event:<10} {scan}: {text}")


def _print_json(event: Event, scan: Path, text: str) -> None:
    print_result(json.dumps({"state": event, "name": str(scan), "text": text}))


def _summary(watching: Watch) -> str:
    counts = watching.counts
    return f"{counts['restored']} restored, {counts['set aside']} set aside"

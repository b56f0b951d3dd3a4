"""The command `planish capture`."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Debug
from station.commands.sessions import Index, Named, enter, find_session
from station.commands.terminal import print_note, print_result, report_faults

Station = Annotated[
    Path | None,
    typer.Option(
        "--config",
        help="Configuration of the station: a TOML file, or `simulated`; else that of the session.",
        show_default=False,
    ),
]
FootSwitch = Annotated[
    str | None, typer.Option(metavar="PORT", help="Serial port of a foot switch that captures the next page.")
]


def capture(
    session: Named, config: Station = None, foot_switch: FootSwitch = None, index: Index = None, debug: Debug = False
) -> None:
    """Capture a volume page by page, with quality checks.

    Each page is restored and checked while the next one is captured.
    """
    with report_faults(debug=debug), ExitStack() as stack:
        import drivers
        from station.capture_loop import keys
        from station.capture_loop.loop import CaptureLoop
        from station.capture_loop.triggering import laser_note, triggered
        from station.capture_loop.turning import stay, turn
        from station.config import load_config
        from station.errors import UsageError
        from station.session import open_session
        from station.session.derivation.restoration import run_restore
        from station.workers.background import background

        writer = stack.enter_context(open_session(find_session(index, session)))
        named = writer.session.volume.station
        station = load_config(config or Path(named)) if config or named else None
        stack.callback(lambda: enter(index, writer.session))
        submit = stack.enter_context(background(run_restore))
        scanner, take, turned = None, None, stay
        if station is not None:
            try:
                scanner = stack.enter_context(drivers.open_scanner(station.scanner))
            except drivers.SettingsError as error:
                raise UsageError(f"configuration: {error}", error.hint) from error
            settings = station.capture
            take, turned = partial(scanner.capture, settings), partial(turn, scanner)
            if note := laser_note(station.scanner):
                print_note(note)
        loop = CaptureLoop(
            writer,
            take,
            submit,
            lambda message: print_result(message.text),
            changed=lambda: enter(index, writer.session),
            turn=turned,
        )
        stack.enter_context(keys.single_strokes(sys.stdin))
        stack.enter_context(keys.foot_switch(foot_switch, lambda: loop.inbox.put(" ")))
        keys.read_keys(sys.stdin, loop.inbox.put)
        with triggered(scanner, loop):
            loop.run()

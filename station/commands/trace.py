"""`planish trace`: SCSI commands of a scanner from USB captures.

They are extracted from captures of the USB bus and compared.
"""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import Debug, Force, Json, output_path
from station.commands.terminal import print_result, report_faults

if TYPE_CHECKING:
    from drivers.trace.exchanges import Exchange


def trace(
    captures: Annotated[
        list[Path], typer.Argument(metavar="CAPTURE...", help="pcapng files from usbmon, Wireshark or USBPcap.")
    ],
    setting: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=A,B,...",
            help="Setting in which the captures differ, with its values: find its field.",
            show_default=False,
        ),
    ] = None,
    draft: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draft of a command profile to write (TOML).", show_default=False, parser=output_path
        ),
    ] = None,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Decode SCSI commands from USB captures; draft a profile.

    Of two captures the differences are listed.
    """
    with report_faults(debug=debug):
        from drivers.trace.capture import read_transfers
        from drivers.trace.compare import list_changes, list_field
        from drivers.trace.exchanges import read_exchanges
        from drivers.trace.listing import as_data, list_exchanges
        from station.errors import UsageError
        from station.storage.atomic import refuse_existing

        if draft:
            refuse_existing([draft], force=force)
        found = [read_exchanges(read_transfers(capture)) for capture in captures]
        if draft:
            _write_draft(draft, list(chain.from_iterable(found)), force=force)
        if setting:
            lines = list_field(found, *_setting(setting))
        elif len(found) == 2:
            lines = list_changes(*found)
        elif len(found) > 2:
            raise UsageError(
                "more than two captures are compared by a setting", "name its values: --setting gain=0,1,3"
            )
        else:
            lines = list_exchanges(found[0])
        print_result(json.dumps(as_data(found[0])) if as_json else "\n".join(lines))


def _setting(text: str) -> tuple[str, list[int]]:
    """Name and values of a setting. Raises UsageError."""
    from station.errors import UsageError

    name, _, values = text.partition("=")
    try:
        return name, [int(value) for value in values.split(",")]
    except ValueError:
        hint = "write it like distance_mm=600,900,1200, a value for each capture in their order"
        raise UsageError(f"{text!r} is not a setting with values", hint) from None


def _write_draft(path: Path, exchanges: list[Exchange], *, force: bool) -> None:
    from drivers.trace.draft import draft_profile
    from station.storage.atomic import write_all

    numbered = [replace(exchange, number=number) for number, exchange in enumerate(exchanges)]
    write_all([(path, draft_profile(numbered, name=path.stem).encode())], force=force)

"""`planish trace`: SCSI commands of a scanner, extracted from a capture of the USB bus."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from station.options import Debug, Force, Json
from station.terminal import print_result, report_faults


def trace(
    capture: Annotated[
        Path, typer.Argument(metavar="CAPTURE", help="A pcapng file from usbmon, Wireshark or USBPcap.")
    ],
    profile: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a draft of a command profile (TOML).", show_default=False)
    ] = None,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """List the SCSI commands in a capture of the vendor's program, and draft a command profile."""
    with report_faults(debug=debug):
        from drivers.vivid900.trace.capture import read_transfers
        from drivers.vivid900.trace.draft import draft_profile
        from drivers.vivid900.trace.exchanges import read_exchanges
        from drivers.vivid900.trace.listing import as_data, list_exchanges
        from station.export.atomic import refuse_existing, write_all

        if profile:
            refuse_existing([profile], force=force)
        exchanges = read_exchanges(read_transfers(capture))
        if profile:
            draft = draft_profile(exchanges, name=profile.stem)
            write_all([(profile, draft.encode())], force=force)
        print_result(json.dumps(as_data(exchanges)) if as_json else "\n".join(list_exchanges(exchanges)))

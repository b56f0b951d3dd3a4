"""The command `planish export`."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from functools import partial
from typing import Annotated

import typer

from station.commands.options import Debug, Out
from station.commands.sessions import Index, Named, find_session
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on

FORMATS = ("bagit", "mets", "iiif", "pdf", "tiff", "mesh")
Url = Annotated[
    str, typer.Option(metavar="URL", help="Address of the web folder that the IIIF export will be served from.")
]


def export(
    session: Named,
    to: Annotated[str, typer.Option(metavar="FORMAT", help=f"{', '.join(FORMATS)}.", show_default=False)],
    output: Out,
    url: Url = "http://localhost:8000",
    index: Index = None,
    debug: Debug = False,
) -> None:
    """Export a session: BagIt, METS, IIIF, PDF/A, TIFF, mesh.

    Files that a format needs and the session lacks are listed as missing.
    """
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.archive.deliver import Format, deliver
        from station.archive.from_session import scan_of, volume_of
        from station.archive.iiif import folder_address
        from station.errors import UsageError
        from station.session import read_session

        if to not in FORMATS:
            raise UsageError(f"--to {to}: no such format", f"use one of {', '.join(FORMATS)}")
        address = folder_address(url)
        stored = read_session(find_session(index, session))
        delivery = deliver(
            volume_of(stored),
            Format(to),
            output.absolute(),
            address=address,
            now=datetime.now(UTC),
            source=partial(scan_of, stored),
            progress=progress,
        )
        lines = [f"{'missing':<10} {line}" for line in delivery.missing]
        print_result("\n".join([*lines, f"{'files':<10} {delivery.files}", f"{'folder':<10} {delivery.folder}"]))

"""The command `planish export`."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from functools import partial
from typing import Annotated

import typer

from station.archive.formats import Format, Overlap, Parts
from station.commands.options import Debug, Json, Out
from station.commands.sessions import Index, Named, find_session
from station.commands.terminal import print_result, report_faults
from station.progress import progress_on

Url = Annotated[str, typer.Option(metavar="URL", help="Web address from which the IIIF export will be served.")]


def export(
    session: Named,
    to: Annotated[Format, typer.Option(help="Format of the export.")],
    output: Out,
    url: Url = "http://localhost:8000",
    parts: Annotated[Parts, typer.Option(help="Opened books: leaves, or the whole where it was kept.")] = Parts.AUTO,
    names: Annotated[
        str,
        typer.Option(metavar="number|label|PATTERN", help="Names of TIFF files and meshes, as {order:04}_{label}."),
    ] = "number",
    overlap: Annotated[Overlap, typer.Option(help="Strip of the facing page in images and PDF.")] = Overlap.KEEP,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Export a session: BagIt, METS, IIIF, PDF/A, TIFF, mesh.

    Files that a format needs and the session lacks are listed as missing.
    """
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.archive.deliver import deliver
        from station.archive.from_session import scan_of, volume_of
        from station.archive.iiif import folder_address
        from station.session import read_session

        address = folder_address(url)
        stored = read_session(find_session(index, session))
        delivery = deliver(
            volume_of(stored, whole=parts == Parts.WHOLE),
            to,
            output.absolute(),
            address=address,
            now=datetime.now(UTC),
            source=partial(scan_of, stored),
            names=names,
            trim=overlap == Overlap.TRIM,
            progress=progress,
        )
        if as_json:
            report = {"folder": str(delivery.folder), "files": delivery.files, "missing": delivery.missing}
            print_result(json.dumps(report, indent=2, ensure_ascii=False))
            return
        lines = [f"{'missing':<10} {line}" for line in delivery.missing]
        print_result("\n".join([*lines, f"{'files':<10} {delivery.files}", f"{'folder':<10} {delivery.folder}"]))

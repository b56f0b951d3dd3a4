"""The command that draws a contact sheet of a session."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from station.commands.options import Debug, Force, Json
from station.commands.sessions import Index, Named, find_session
from station.commands.terminal import print_result, report_faults


def sheet(
    session: Named,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="PDF to write.")],
    columns: Annotated[int, typer.Option(min=1, max=20, help="Leaves in a row.")] = 6,
    force: Force = False,
    index: Index = None,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Draw the leaves of a session as a contact sheet, a PDF."""
    with report_faults(debug=debug):
        import json

        from station.archive.contact_sheet import contact_sheet
        from station.session import read_session
        from station.session.leaves.leaf import leaves_of
        from station.storage.atomic import lock_output_folder, refuse_existing, write_all
        from station.storage.session_folder import refuse_session

        stored = read_session(find_session(index, session))
        refuse_session(output)
        refuse_existing([output], force=force)
        data = contact_sheet(stored, columns)
        path = output.absolute()
        with lock_output_folder(path.parent) as lock:
            write_all([(path, data)], force=force, lock=lock)
        count = len(leaves_of(stored))
        print_result(json.dumps({"file": str(output), "leaves": count}) if as_json else f"{output}\n{count} leaves")

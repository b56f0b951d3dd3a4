"""`planish compile`: compiles the numerical kernels.

The first scan then need not wait for them.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from station.commands.terminal import print_result, report_faults
from station.run.small_page import small_page

POINTS = 10_000  # more than there are: all are kept, which needs no library of the system
OUTPUTS = frozenset({"mesh", "review"})  # the mesh is restored in its turn


def compile_kernels() -> int:
    """Restore a small page as a scan and as a mesh.

    Functions of other methods, formats and outputs are compiled when they are first used; progress says so. Returns the
    number of functions compiled.
    """
    from restore import Settings, save_scan
    from restore.runtime import notify_when_compiling
    from station.run.destination import Destination
    from station.run.one_page import restore_file
    from station.run.options import RunOptions

    compiled: list[None] = []
    with tempfile.TemporaryDirectory() as name, notify_when_compiling(lambda: compiled.append(None)):
        folder = Path(name)
        save_scan(small_page(), folder / "page.scan")
        for source in ("page.scan", "page-warped.obj"):  # the first leaves the second
            options = RunOptions(Settings(points=POINTS), OUTPUTS)
            restore_file(folder / source, Destination(folder, force=True), options)
    return len(compiled)


def compile_command(
    debug: Annotated[bool, typer.Option("--debug", help="Print the traceback of an error.")] = False,
) -> None:
    """Compile the numerical kernels before the first run.

    Kernels of the default method only; others are compiled when they are first used.
    """
    with report_faults(debug=debug):
        count = compile_kernels()
        print_result(f"{count} functions compiled" if count else "all kernels are compiled already")

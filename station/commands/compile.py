"""`planish warm-up`: compile the numerical kernels before the first scan has to wait for them."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated, get_args

import typer

from station.commands.terminal import print_result, report_faults
from station.run.small_page import small_page

POINTS = 10_000  # more than there are: all are kept, which needs no library of the system
# The mesh of a format whose reader has kernels of its own.
TRIANGLE = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 -900 9 0 -900 0 9 -900
3 0 1 2
"""


def compile_kernels() -> int:
    """Restore a small page by every method, as a scan and as a mesh. Returns the number of functions compiled."""
    from restore import Settings, load_scan, save_scan
    from restore.runtime import notify_when_compiling
    from station.export.outputs import OUTPUTS
    from station.run.destination import Destination
    from station.run.one_page import restore_file

    compiled: list[None] = []
    with tempfile.TemporaryDirectory() as name, notify_when_compiling(lambda: compiled.append(None)):
        folder = Path(name)
        save_scan(small_page(), folder / "page.scan")
        kinds = frozenset(output.kind for output in OUTPUTS) - {"ocr"}
        destination = Destination(folder, kinds, force=True)
        for method in get_args(Settings.model_fields["method"].annotation):
            settings = Settings(points=POINTS, method=method, shading="remove", fill_hidden_mm=1.0)
            for source in ("page.scan", "page-warped.obj"):  # the first leaves the second
                restore_file(folder / source, destination, settings=settings)
        (folder / "triangle.ply").write_text(TRIANGLE)
        load_scan(folder / "triangle.ply")
    return len(compiled)


def warm_up(
    debug: Annotated[bool, typer.Option("--debug", help="Show where in the program a fault happened.")] = False,
) -> None:
    """Compile the numerical kernels, once, so that no restoration has to wait for them."""
    with report_faults(debug=debug):
        count = compile_kernels()
        print_result(f"{count} functions compiled" if count else "all kernels are compiled already")

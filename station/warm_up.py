"""`planish warm-up`: compile the numerical kernels before the first scan has to wait for them."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from station.terminal import print_result, report_faults

if TYPE_CHECKING:
    from restore import RangeScan

ROWS, COLS = 40, 56  # enough for every step
PITCH = 1 / 485.0  # of the lines of sight, one millimetre deep: every fourth pixel of the MIDDLE lens
RADIUS_MM, DISTANCE_MM = 200.0, 900.0
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


def small_page() -> RangeScan:
    """A scan of (ROWS, COLS) samples of a page of noise that is curled round an upright cylinder."""
    import numpy as np

    from restore import RangeScan

    rows, cols = np.indices((ROWS, COLS)).astype(float)
    x, y = (cols - (COLS - 1) / 2) * PITCH, ((ROWS - 1) / 2 - rows) * PITCH
    # Where a line of sight (x, y, −1)·depth meets the cylinder: (depth·x)² + (depth − axis)² = radius².
    axis = DISTANCE_MM + RADIUS_MM
    depth = (axis - np.sqrt(axis**2 - (1 + x**2) * (axis**2 - RADIUS_MM**2))) / (1 + x**2)
    points = np.dstack([x * depth, y * depth, -depth])
    texture = np.random.default_rng(1).integers(0, 256, (ROWS, COLS, 3), np.uint8)
    return RangeScan(points, texture, np.dstack([cols, rows]), {})


def compile_kernels() -> int:
    """Restore a small page by every method, as a scan and as a mesh. Returns the number of functions compiled."""
    from restore import Settings, load_scan, notify_when_compiling, save_scan
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

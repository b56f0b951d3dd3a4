"""`planish board`, `calibrate` and `axis`.

They calibrate a body and its lens, and a turntable, from scans of a marker board.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from station.commands.options import Config, Debug, Force, Json, Out, output_path, require_suffix
from station.commands.terminal import print_result, report_faults
from station.errors import UsageError
from station.progress import progress_on

if TYPE_CHECKING:
    from drivers.vivid900.calibrating.board import Board
    from drivers.vivid900.calibrating.calibrate import CalibrationResult
    from restore import RangeScan

BOARD_DPI = 300.0  # of an office printer
FROM_FRONT = re.compile(r"(?P<path>.+)@(?P<mm>\d+(\.\d+)?)")

Columns = Annotated[int, typer.Option(min=2, max=50, help="Markers in a row of the board.")]
Rows = Annotated[int, typer.Option(min=2, max=50, help="Rows of markers on the board.")]
MarkerSize = Annotated[float, typer.Option(min=1, max=500, help="Side of a marker as printed, mm: measure it.")]
MarkerPitch = Annotated[
    float, typer.Option(min=1, max=1000, help="Distance from marker to marker as printed, mm: measure it.")
]


def board(
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PNG", help="Image to write.", show_default=False, parser=output_path),
    ],
    columns: Columns = 12,
    rows: Rows = 9,
    marker_size: MarkerSize = 16.002,
    marker_pitch: MarkerPitch = 21.505,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Draw the marker board for scanner calibration (PNG).

    Print the board at 100 % and glue it to a flat plate.
    """
    with report_faults(debug=debug):
        import cv2

        from station.images.png import encode_png
        from station.storage.atomic import write_all

        require_suffix(output, ".png")
        picture = _board(columns, rows, marker_size, marker_pitch).picture(BOARD_DPI)
        write_all([(output, encode_png(cv2.cvtColor(picture, cv2.COLOR_GRAY2RGB), BOARD_DPI))], force=force)
        print_result(f"{output}: print it at 100 %, then measure markers and pitch for `planish calibrate`")


def calibrate(
    scans: Annotated[
        list[str],
        typer.Argument(
            metavar="SCAN[@MM]...",
            help="Scan folders of the board, or of a bare plate that fills the image; @MM: its measured distance "
            "from the front of the lens.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Calibration file (TOML) to write.",
            show_default=False,
            parser=output_path,
        ),
    ],
    columns: Columns = 12,
    rows: Rows = 9,
    marker_size: MarkerSize = 16.002,
    marker_pitch: MarkerPitch = 21.505,
    force: Force = False,
    as_json: Json = False,
    debug: Debug = False,
) -> None:
    """Calibrate a scanner and lens from scans of the board."""
    with report_faults(debug=debug):
        from drivers.vivid900.calibrating.calibrate import calibrate as calibrate_body
        from drivers.vivid900.calibrating.calibrate import with_measurement
        from drivers.vivid900.calibrating.plates import nominal_of_scans, plate_shot
        from drivers.vivid900.geometry.calibration import encode_calibration
        from station.storage.atomic import refuse_existing, write_all

        refuse_existing([output], force=force)
        printed_board = _board(columns, rows, marker_size, marker_pitch)
        loaded = list(_load(scans))
        shots = [plate_shot(scan, printed_board, front_mm=front_mm) for scan, front_mm in loaded]
        result = with_measurement(
            calibrate_body(shots, nominal_of_scans([scan for scan, _ in loaded])), len(shots), date.today()
        )
        summary = list(_summary(result, len(shots)))
        write_all([(output, encode_calibration(result.calibration, comments=summary).encode())], force=force)
        print_result(json.dumps(asdict(result)) if as_json else "\n".join([*summary, str(output)]))


def axis(
    config: Config,
    output: Out,
    views: Annotated[int, typer.Option(min=3, max=72, help="Views of the board.")] = 4,
    force: Force = False,
    debug: Debug = False,
) -> None:
    """Find the turntable axis from scans of a marker board."""
    with report_faults(debug=debug), progress_on(sys.stderr) as progress:
        from station.config import load_config
        from station.run.destination import Destination
        from station.run.turntable import find_axis

        table, path = find_axis(load_config(config), Destination(output, force=force), turns=views, progress=progress)
        print_result(f"{path}\n{table.rstrip()}")


def _board(columns: int, rows: int, marker_mm: float, pitch_mm: float) -> Board:
    from drivers.vivid900.calibrating.board import MAX_MARKERS, Board

    if columns * rows > MAX_MARKERS:
        raise UsageError(f"a board has {MAX_MARKERS} markers at most", "lower --columns or --rows")
    if pitch_mm <= marker_mm:
        raise UsageError("the markers would overlap", "--marker-pitch has to be greater than --marker-size")
    return Board(columns, rows, marker_mm, pitch_mm)


def _load(scans: Sequence[str]) -> Iterator[tuple[RangeScan, float | None]]:
    """The scans, each with its distance from the front of the lens where one is given."""
    from restore import BadInput, RangeScan, load_scan

    for name in scans:
        measured = None if Path(name).exists() else FROM_FRONT.fullmatch(name)
        path, front_mm = (Path(measured["path"]), float(measured["mm"])) if measured else (Path(name), None)
        try:
            scan = load_scan(path)
        except OSError as error:
            raise BadInput(f"cannot read {error.filename or path}: {error.strerror}", "check the path") from error
        if not isinstance(scan, RangeScan):
            raise BadInput(f"{path} is a mesh", "give scan folders as `planish scan` stores them")
        yield scan, front_mm


def _summary(result: CalibrationResult, shots: int) -> Iterator[str]:
    body = result.calibration
    yield f"{body.lens} {body.lens_serial} on body {body.body}".replace("  ", " ").removesuffix(" on body ")
    yield f"{shots} captures; rms of the markers {result.markers_px:.3f} px, of the samples {result.lines:.3f} lines"
    yield (
        f"largest error to expect over the field, one sigma: {result.expected_mm:.2f} mm of a place, "
        f"{1000 * result.expected_length:.2f} mm of a length of a metre"
    )
    yield "sigmas: " + ", ".join(f"{name} {sigma:.2g}" for name, sigma in result.sigma.items())

"""CSV of LMI's Gocator: the section SurfacePointCloud.

am.lmi3d.com, "SurfacePointCloud": a row of attributes with Row Count and Column Count, a row to be ignored, then rows
of x, y, z in millimetres, of the points of a rectangular grid. Sections begin with their name and close with End.
Heights z rise to the sensor, and x, y, z are left-handed (manual, "Swap X/Y" of the CSV converter): y runs down.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.clouds.cloud import Cloud, check_count, cloud_of
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, parse_numbers
from restore.numerics.units import UNIT_MM
from restore.range_image.organise import MIN_LINES

MAX_PAGE_MM = UNIT_MM["m"] * 10  # no surface is larger: the sensor is farther off than any part of it
SECTION = b"\nSurfacePointCloud"


def is_gocator(text: bytes) -> bool:
    """Whether a CSV has the section."""
    return SECTION in text or text.startswith(SECTION[1:])


def gocator_cloud(path: Path, text: bytes) -> Cloud:
    """Return the cloud of a text that has the section. Raises BadInput."""
    section = (b"\n" + text).partition(SECTION)[2].partition(b"\nEnd")[0]
    lines = section.split(b"\n", 4)
    facts = dict(zip(*([word.strip().lower() for word in line.split(b",")] for line in lines[1:3]), strict=False))
    try:
        rows, cols = (int(float(facts[name])) for name in (b"row count", b"column count"))
    except (KeyError, ValueError, OverflowError) as error:
        raise BadInput(f"{path}: its section does not count rows and columns", DAMAGED) from error
    if min(rows, cols) < MIN_LINES:
        raise BadInput(f"{path}: a grid of {cols} × {rows} points cannot be", DAMAGED)
    check_count(path, rows * cols)
    if len(lines) < 5:
        raise BadInput(f"{path} seems cut short: its section has no points", CUT_SHORT)
    points = _points(path, lines[4], rows, cols)
    points[:, 1] *= -1.0
    return cloud_of(path, points, size=(cols, rows), viewpoint=np.array([0.0, 0.0, MAX_PAGE_MM]))


def _points(path: Path, text: bytes, rows: int, cols: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    text = text.replace(b" ", b"").replace(b"\r", b"").rstrip(b"\n")
    text = b"\n".join(line.removesuffix(b",") if line.count(b",") >= 3 * cols else line for line in text.split(b"\n"))
    while b",," in text:  # a missing coordinate
        text = text.replace(b",,", b",nan,")
    text = (b"\n" + text + b"\n").replace(b"\n,", b"\nnan,").replace(b",\n", b",nan\n")
    values = parse_numbers(text.replace(b",", b" "), path, "its points")
    if len(values) < 3 * rows * cols:
        raise BadInput(f"{path} seems cut short: it promises {rows * cols} points and holds less", CUT_SHORT)
    if len(values) > 3 * rows * cols:
        raise BadInput(f"{path} holds more than the {rows * cols} points that it promises", DAMAGED)
    return values.reshape(-1, 3)

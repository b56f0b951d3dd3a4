"""`.e57`: ASTM E2807, in metres, by the extra `planish[e57]`.

libE57Format reads it in a process of its own, with a limit of memory and time: a damaged file ends that process alone.
Scans with `rowIndex` and `columnIndex` are organised; several scans are one loose cloud, each in its pose.
"""

from __future__ import annotations

import importlib.util
import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from restore.errors import BadInput, LibraryMissing
from restore.formats.clouds.cloud import MAX_BYTES, MAX_POINTS, Cloud, Size, check_count, cloud_of
from restore.formats.parsing.source import DAMAGED, read_bytes
from restore.range_image.organise import MIN_LINES
from restore.scan import Bytes, Floats, Ints

TIME_S = 60.0  # of which eight million points take a sixth
READER = Path(__file__).with_name("e57_process.py")


def read_e57(path: Path, size: Size | None = None) -> Cloud:  # noqa: ARG001 - it is stated
    """Read the cloud of a file. Raises BadInput, LibraryMissing without the extra."""
    if not read_bytes(path, MAX_BYTES).startswith(b"ASTM-E57"):
        raise BadInput(f"{path} is not an E57 file", DAMAGED)
    if importlib.util.find_spec("pye57") is None:
        raise LibraryMissing("E57 files need the library pye57", "install planish[e57]")
    arrays = _in_process(path)
    points = arrays["points"]
    colours, intensity = arrays.get("colours"), arrays.get("intensity")
    pose = arrays["pose"]
    facts = {"viewpoint": pose[3], "axes": pose[:3].T, "frame": "right-handed"}
    check_count(path, len(points))
    if "places" not in arrays:
        return cloud_of(path, points, colours, intensity, **facts)
    return _on_grid(path, points, arrays["places"].astype(np.int64), colours, intensity, facts)


def _on_grid(
    path: Path, points: Floats, places: Ints, colours: Bytes | None, intensity: Floats | None, facts: dict[str, Any]
) -> Cloud:
    rows, cols = (int(side) for side in np.ptp(places, axis=0) + 1)
    if min(rows, cols) < MIN_LINES or rows * cols > MAX_POINTS:
        return cloud_of(path, points, colours, intensity, **facts)
    row, col = (places - places.min(axis=0)).T
    number = row * cols + col
    grid = np.full((rows * cols, 3), np.nan)
    grid[number] = points
    spread = [
        None if some is None else np.zeros((rows * cols, *some.shape[1:]), some.dtype) for some in (colours, intensity)
    ]
    for target, some in zip(spread, (colours, intensity), strict=True):
        if target is not None:
            target[number] = some
    return cloud_of(path, grid, *spread, size=(cols, rows), **facts)


def _in_process(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays that the reader's process writes."""
    command = [sys.executable, "-I", str(READER), str(path.absolute()), str(MAX_POINTS)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=TIME_S, check=False, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired as error:
        raise BadInput(f"{path} takes more than {TIME_S:.0f} s to read", DAMAGED) from error
    if done.returncode != 0:
        lines = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise BadInput(f"{path} cannot be read: {lines[-1][:200] if lines else 'its reader ended'}", DAMAGED)
    try:
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as arrays:
            return dict(arrays)
    except Exception as error:  # of a reader that was ended while it wrote
        raise BadInput(f"{path} cannot be read: {error}", DAMAGED) from error

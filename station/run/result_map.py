"""Places on the last result of a scan, in mm, as pixels of the scan's image."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from restore import BadInput
from restore.scan import Floats

MM_PER_INCH = 25.4
REACH_MM = 2.0  # from the paper: a spine is drawn to the edge, an outline slightly beyond it
HINT = "restore the scan once with --map, as one page, into the same folder; or give pixels of the source image"


def pixels_of(points_mm: Sequence[Sequence[float]], path: Path) -> list[list[float]]:
    """Return points (x, y) mm of a result as pixels of the source image.

    They are from its upper left corner. path: of the map that `--map` wrote with the result.
    Raises BadInput without a map, for one of photographs, and for a point off the paper.
    """
    source, dpi = read_map(path)
    found = []
    for x, y in points_mm:
        at = np.array([y, x]) * dpi / MM_PER_INCH - 0.5
        place = _nearest(source, at, REACH_MM * dpi / MM_PER_INCH)
        if place is None:
            raise BadInput(
                f"the point {x:g},{y:g} mm is not on the page", "give points on the paper of the last result"
            )
        found.append([round(float(value), 2) for value in source[place]])
    return found


def read_map(path: Path) -> tuple[Floats, float]:
    """Return the map (h, w, 2) of a result, px, and its dots per inch. Raises BadInput."""
    import tifffile

    try:
        with tifffile.TiffFile(path) as file:
            page = file.pages[0]
            values, resolution = np.asarray(page.asarray(), float), page.tags["XResolution"].value
        dpi = resolution[0] / resolution[1]
    except FileNotFoundError as error:
        raise BadInput(f"{path} does not exist: mm need the map of the last result", HINT) from error
    except (OSError, ValueError, KeyError, AttributeError, ZeroDivisionError, tifffile.TiffFileError) as error:
        raise BadInput(f"{path} is not a map: {error}", HINT) from error
    if values.ndim != 3 or values.shape[2] != 2:
        raise BadInput(f"{path} is not a map of one source image", HINT)
    return values, dpi


def _nearest(source: Floats, at: Floats, reach: float) -> tuple[int, int] | None:
    """Return row and column of the paper nearest to a place (2,) px, None far off."""
    low = np.maximum(np.floor(at - reach).astype(int), 0)
    high = np.maximum(np.ceil(at + reach).astype(int) + 1, 0)
    rows, cols = np.nonzero(np.isfinite(source[low[0] : high[0], low[1] : high[1], 0]))
    if rows.size == 0:
        return None
    apart = np.hypot(rows + low[0] - at[0], cols + low[1] - at[1])
    best = int(np.argmin(apart))
    return (int(rows[best] + low[0]), int(cols[best] + low[1])) if apart[best] <= reach else None

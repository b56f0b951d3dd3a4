"""Removes rows and columns that a segment has twice.

One written over the next is filled in, a surplus one is skipped.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import label

from restore.findings import Finding
from restore.flattening.ordered_grid import NO_LENGTH
from restore.numerics.robust import NEARLY_ALL
from restore.scan import Floats, Mask

WIDE = 1.5  # median links: a line is missing there
NAMES = ("rows", "columns")


def _doubled(axis: int, filled: int, left_out: int) -> Finding:
    """What is to be reported of lines along an axis that were there twice."""
    done = [f"{filled} interpolated"] if filled else []
    done += [f"{left_out} skipped"] if left_out else []
    return Finding.of("lines_doubled", lines=NAMES[axis], done=", ".join(done))


def without_doubled_lines(
    points: Floats, valid: Mask, places: Floats | None
) -> tuple[Floats, Mask, Floats | None, list[Finding]]:
    """Return a grid without doubled lines, and findings.

    points: (rows, cols, 3).
    valid: (rows, cols).
    places: (rows, cols, 2).
    """
    findings = []
    for axis in (0, 1):
        points, valid = np.moveaxis(points, axis, 0), np.moveaxis(valid, axis, 0)
        places = None if places is None else np.moveaxis(places, axis, 0)
        points, valid, kept, filled = _along_rows(points, valid)
        places = None if places is None else places[kept]
        if filled or not kept.all():
            findings.append(_doubled(axis, filled, int((~kept).sum())))
        points, valid = np.moveaxis(points, 0, axis), np.moveaxis(valid, 0, axis)
        places = None if places is None else np.moveaxis(places, 0, axis)
    return points, valid, places, findings


def _along_rows(points: Floats, valid: Mask) -> tuple[Floats, Mask, Mask, int]:
    """Return points without doubled rows, and which are valid.

    Returns also which rows were kept, and how many were filled in.
    """
    kept, filled = np.ones(len(points), bool), 0
    with np.errstate(over="ignore", invalid="ignore"):  # of a damaged file, which is refused later
        links = np.where(valid[1:] & valid[:-1], np.linalg.norm(np.diff(points, axis=0), axis=2), np.nan)
    counted = np.isfinite(links)
    if not counted.any():
        return points, valid, kept, filled
    typical = float(np.nanmedian(links))
    empty = counted & (links < NO_LENGTH * typical)
    runs, count = label(empty.sum(axis=1) > NEARLY_ALL * np.maximum(counted.sum(axis=1), 1))
    if not count:
        return points, valid, kept, filled
    lengths = np.array(
        [np.median(row[known]) if known.any() else 0.0 for row, known in zip(links, counted, strict=True)]
    )
    points, valid = points.copy(), valid.copy()
    for run in range(1, count + 1):
        first, last = np.flatnonzero(runs == run)[[0, -1]]
        last += 1  # the rows of the run are all the same
        if last < len(lengths) and lengths[last] > WIDE * typical:
            start, end = first, last + 1
        elif first > 0 and lengths[first - 1] > WIDE * typical:
            start, end = first - 1, last
        else:
            kept[first + 1 : last + 1] = False
            continue
        filled += end - start - 1
        both = valid[start] & valid[end]
        for row in range(start + 1, end):
            fraction = (row - start) / (end - start)
            points[row] = np.where(
                both[:, None], (1.0 - fraction) * points[start] + fraction * points[end], points[row]
            )
            valid[row] &= both
    return points[kept], valid[kept], kept, filled

"""Size of the grid of an organised cloud.

It is stated, or found as what makes neighbours near each other.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from restore.errors import BadInput
from restore.formats.clouds.cloud import SUBSET, Cloud, Size
from restore.formats.parsing.picture import adjacent_picture
from restore.formats.parsing.unit import AUTO
from restore.numerics.robust import MAJORITY
from restore.range_image.organise import MIN_LINES
from restore.scan import Floats

NEAR = 0.1  # of the distance of any two points: in a grid of ten rows the next one is as near
DISTINCT = 1.2  # times as far: neighbours of another size; of one column more they are 1.4 times as far
_SIZE = re.compile(r"(\d{1,6})[xX×](\d{1,6})")
_PAIR = re.compile(rb"(\d{1,6})\s*[xX*]\s*(\d{1,6})")
_SIDES = tuple(
    re.compile(rb"(?:^|[^a-z])(?:num_?|image_?|grid_?)?(?:" + names + rb")\b\D{0,3}(\d{1,6})\b", re.IGNORECASE)
    for names in (rb"width|cols|columns", rb"height|rows")
)


def parse_grid(text: str) -> Size | None:
    """Return columns and rows of a text such as 2064x1544, None for `auto`. Raises BadInput."""
    if text == AUTO:
        return None
    found = _SIZE.fullmatch(text)
    if found is None or min(int(found[1]), int(found[2])) < MIN_LINES:
        raise BadInput(f"{text!r} is not the size of a grid", "give columns and rows, as 2064x1544")
    return int(found[1]), int(found[2])


def sized(path: Path, cloud: Cloud, given: Size | None, stated: Size | None = None) -> Cloud:
    """Return the cloud with the size of its grid, as given, as stated, or as its points show.

    Raises BadInput.
    """
    count = len(cloud.points)
    size = stated or likely_size(path, cloud.points) if given is None else _checked(path, given, count)
    return replace(cloud, size=size)


def _checked(path: Path, size: Size, count: int) -> Size:
    cols, rows = size
    if cols * rows != count:
        raise BadInput(f"{path} has {count} points, a grid of {cols} × {rows} has {cols * rows}", _hint(count))
    return size


def stated_size(lines: Sequence[bytes], count: int) -> Size | None:
    """Return the size that remarks of a file state, None where it does not fit `count`."""
    text = b"\n".join(lines)
    pairs = [(int(a), int(b)) for a, b in _PAIR.findall(text)]
    widths, heights = ([int(number) for number in side.findall(text)] for side in _SIDES)
    pairs += [(cols, rows) for cols in widths for rows in heights]
    return next((size for size in pairs if size[0] * size[1] == count and min(size) >= MIN_LINES), None)


def likely_size(path: Path, points: Floats) -> Size | None:
    """Return the size that makes the next point and that of the next row near each other.

    A picture of the same name in the folder may state it, too. None for a cloud that is not a grid.
    points: (n, 3), NaN where missing.
    Raises BadInput where two sizes are as likely.
    """
    count = len(points)
    apart = _apart(points, count // 2 + 1)
    sizes = _divisors(count)
    if not sizes or not _apart(points, 1) < NEAR * apart:
        return None
    steps = np.array([_apart(points, cols) for cols, _ in sizes])
    along = np.array([cols for cols, _ in sizes]) * _apart(points, 1)  # as far as on the way to the end of the row
    steps[~(steps < MAJORITY * along)] = np.inf
    best = int(np.argmin(steps))
    if not steps[best] < NEAR * apart:
        return None
    alike = [size for size, step in zip(sizes, steps, strict=True) if step < DISTINCT * steps[best]]
    if len(alike) > 1:
        picture = adjacent_picture(path)
        same = [] if picture is None else [s for s in alike if s[0] * picture.shape[0] == s[1] * picture.shape[1]]
        if len(same) != 1:
            names = " or ".join(f"{cols}x{rows}" for cols, rows in alike[:3])
            raise BadInput(f"{path}: its {count} points are a grid of {names}", f"give the size: --grid {names}")
        return same[0]
    return sizes[best]


def _divisors(count: int) -> list[Size]:
    lower = [k for k in range(MIN_LINES, int(count**0.5) + 1) if count % k == 0]
    return [(k, count // k) for k in sorted({*lower, *(count // k for k in lower)})]


def _apart(points: Floats, step: int) -> float:
    """Return the median distance of points that many places apart, NaN without any."""
    at = np.linspace(0, max(len(points) - step - 1, 0), SUBSET).astype(np.int64)
    if step >= len(points):
        return np.nan
    distance = np.linalg.norm(points[at + step] - points[at], axis=1)
    known = distance[np.isfinite(distance)]
    return float(np.median(known)) if len(known) else np.nan


def _hint(count: int) -> str:
    sizes = _divisors(count)
    square = sorted(sizes, key=lambda size: abs(np.log(size[0] / size[1] * 3 / 4)))[:3]
    names = " or ".join(f"{cols}x{rows}" for cols, rows in square)
    return f"give one of its sizes, as --grid {names}" if square else "leave --grid out"

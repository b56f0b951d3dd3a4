"""The page's edge where no view shows it.

Short stretches and corners are drawn from the measured parts next to them. At a corner no side is long enough to be
measured: it is where the lines of the two sides meet.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from restore.numerics.limits import TINY
from restore.scan import Floats, Ints, Mask

SPACING_MM = 2.0  # of the points of the edge
FLANK = np.arange(1, 7)  # points from what is not measured, along which a side is a line
MIN_OF_SIDE = 3  # of them, measured
LONGEST_MM = 20.0  # that is drawn straight, or to a corner
STRAY_MM = 5.0  # from a straight side: the error of masks where the card lies next to it
CORNER = np.cos(np.deg2rad(30.0))  # between two sides
SHARP_MM = 1.0  # from the meeting of two sides to what was measured there: more is a corner that is cut or round
APART = 3.0  # spacings between neighbours, beyond which one of them is not of this edge
MIN_IN_ROW = 4  # connected points: fewer, away from others of the edge, are chance
TANGLED = 1.5  # times the straight way: what is as long on the flat page is not a side of it
MEETING_MM = 2.0  # between two sides where they pass each other in space: more is not a corner of one page


def bridged(points: Floats, measured: Mask) -> Floats:
    """Draw short unmeasured stretches straight or to a corner.

    points: (n, 3) mm, round a page.
    measured: (n,).
    Returns (n, 3) mm.
    """
    bridged = points.copy()
    for run, before, after in _gaps(measured):
        if len(run) * SPACING_MM < LONGEST_MM:
            bridged[run] = _between(points[before], points[after], len(run))
    return bridged


def straightened(places: Floats, measured: Mask) -> tuple[Floats, Mask]:
    """Draw long unmeasured stretches of an edge straight.

    Those that are nearly straight, or cannot be a side of a page at all.
    places: (n, 2) mm on the page.
    measured: (n,).
    Returns the places, and (n,) which those are.
    """
    drawn, straight = places.copy(), np.zeros(len(places), bool)
    for run, before, after in _gaps(measured):
        (start, _), (stop, _) = _line(places[before[::-1]]), _line(places[after])
        across = np.array([start[1] - stop[1], stop[0] - start[0]]) / max(np.linalg.norm(stop - start), TINY)
        length = np.linalg.norm(np.diff(places[run], axis=0), axis=1).sum()
        tangled = length > TANGLED * np.linalg.norm(stop - start)
        nearly = len(run) * SPACING_MM >= LONGEST_MM and np.abs((places[run] - start) @ across).max() < STRAY_MM
        if nearly or tangled:
            drawn[run], straight[run] = np.linspace(start, stop, len(run) + 2)[1:-1], True
    return drawn, straight


def _gaps(measured: Mask) -> Iterator[tuple[Ints, Ints, Ints]]:
    """Yield the unmeasured stretches of an edge.

    measured: (n,). With the measured points before and after each.
    """
    count = len(measured)
    for start in np.flatnonzero(~measured & np.roll(measured, 1)):
        run = start + np.arange(np.argmax(np.roll(measured, -start)))
        before, after = (run[0] - FLANK[::-1]) % count, (run[-1] + FLANK) % count
        before, after = before[measured[before]], after[measured[after]]
        if min(len(before), len(after)) >= MIN_OF_SIDE:
            yield run % count, before, after


def scattered(points: Floats, measured: Mask) -> Mask:
    """Return the measured points of small groups, (n,) bool.

    points: (n, 3) mm. The other points are not their neighbours.
    """
    joined = measured & np.roll(measured, -1)  # with the next
    joined &= np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1) < APART * SPACING_MM
    if joined.all():
        return np.zeros(len(points), bool)
    first = int(np.argmin(joined)) + 1  # the row of points that hang together begins behind a gap
    number = np.cumsum(~np.roll(np.roll(joined, 1), -first))
    rows = np.roll(np.bincount(number)[number], first)
    return measured & (rows < MIN_IN_ROW)


def at_corners(points: Floats) -> Mask:
    """Return points where two sides meet, which are averaged over both.

    points: (n, 3) mm. Returns (n,) bool.
    """
    found = np.zeros(len(points), bool)
    for number, point in enumerate(points):
        before, after = ((number + way * (1 + FLANK)) % len(points) for way in (-1, 1))
        corner = _corner(*_line(points[before]), *_line(points[after]))
        if corner and np.linalg.norm(corner[0] - point) < SHARP_MM:
            found[(number + np.arange(-1, 2)) % len(points)] = True
    return found


def _between(before: Floats, after: Floats, count: int) -> Floats:
    """Return points (count, 3) between two sides.

    before, after: (k, 3) and (m, 3) mm, the sides. On a straight line, or round their corner.
    """
    (start, ahead), (stop, back) = _line(before[::-1]), _line(after)  # each from its end
    way = [start, *_corner(start, ahead, stop, back), stop]
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))])
    at = np.linspace(0, lengths[-1], count + 2)[1:-1]
    for corner in lengths[1:-1]:
        at[np.abs(at - corner).argmin()] = corner
    return np.stack([np.interp(at, lengths, column) for column in np.transpose(way)], axis=1)


def _line(side: Floats) -> tuple[Floats, Floats]:
    """Return the end of a side and its direction (3,) there.

    side: (k, 3) mm, the first point being the nearest to the end.
    """
    middle = side.mean(axis=0)
    way = np.linalg.svd(side - middle)[2][0]
    way = way * np.sign(way @ (side[0] - side[-1]))
    return middle + (side[0] - middle) @ way * way, way


def _corner(start: Floats, ahead: Floats, stop: Floats, back: Floats) -> list[Floats]:
    """Return the place (3,) mm where two sides meet, if they do.

    They end at `start` and `stop` and point to each other.
    """
    cosine, gap = float(ahead @ back), stop - start
    if abs(cosine) > CORNER:
        return []
    ways = np.linalg.solve([[1.0, -cosine], [cosine, -1.0]], [gap @ ahead, gap @ back])
    one, other = start + ways[0] * ahead, stop + ways[1] * back
    meet = np.linalg.norm(one - other) < MEETING_MM and ways.min() > 0.0 and ways.max() < LONGEST_MM
    return [(one + other) / 2] if meet else []

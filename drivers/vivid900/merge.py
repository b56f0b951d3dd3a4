"""Several shots of the same made one: averaged for less noise, put together for more depth."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drivers.scanner import MAX_DISTANCE_MM, MIN_DISTANCE_MM
from drivers.vivid900.lenses import Lens, Mode, depth_window
from restore.scan import Floats

# A sample that lies farther than this from the median of its fellows was mixed from two surfaces: six times the noise
# of a sample on carbon ink, which is 0.07 lines.
ASTRAY_LINES = 0.4
MOST_DEPTHS = 7  # shots of one page at different depths; seven TELE windows reach 0.3 m at 600 mm
OVERLAP = 0.15  # share of a window by which it overlaps its neighbour
AT_THE_EDGE = 0.06  # a sample this close to the end of the window, as share of it, says that there may be more beyond …
EDGE_SHARE = 0.0005  # … when it has company: 150 samples of a FINE shot


def average(frames: Sequence[Floats], mode: Mode) -> Floats:
    """(rows, cols) mean pitch of shots (rows, cols) of the same, without strays; NaN where no shot saw anything."""
    if len(frames) == 1:
        return frames[0]
    stack = np.stack(frames)
    seen = np.isfinite(stack)
    # NaN sorts last: the median of the seen ones is at half their count.
    count = seen.sum(axis=0)
    middle = np.take_along_axis(np.sort(stack, axis=0), np.maximum(count - 1, 0)[None] // 2, axis=0)
    kept = seen & (np.abs(stack - middle) * mode.step <= ASTRAY_LINES)
    total, number = np.where(kept, stack, 0.0).sum(axis=0), kept.sum(axis=0)
    return np.divide(total, number, out=np.full(total.shape, np.nan), where=number > 0)


def cover_depths(shoot: Callable[[int], Floats], distance_mm: int, lens: Lens, mode: Mode) -> list[tuple[int, Floats]]:
    """Shoot at a distance, then nearer and farther for as long as the surface goes on beyond the window.

    shoot  gives the points (rows, cols, 3) mm of a shot focused at a distance.
    Returns what was shot, with its distances, the given one first.
    """
    taken = [(distance_mm, shoot(distance_mm))]
    for nearer in (True, False):
        distance, points = taken[0]
        while len(taken) < MOST_DEPTHS:
            following = next_depth(points, lens, mode, distance, nearer=nearer)
            if following is None:
                break
            distance, points = following, shoot(following)
            taken.append((distance, points))
    return taken


def next_depth(points: Floats, lens: Lens, mode: Mode, distance_mm: int, *, nearer: bool) -> int | None:
    """The distance at which to shoot next because points (rows, cols, 3) mm reach that end of the depth window, or None
    where nothing goes on, or the scanner cannot focus.
    """
    near, far = depth_window(lens, mode, distance_mm)
    width, inverse = 1 / near - 1 / far, 1 / -points[..., 2]
    edge = inverse > 1 / near - AT_THE_EDGE * width if nearer else inverse < 1 / far + AT_THE_EDGE * width
    step = width * (1 - OVERLAP)
    centre = 1 / (distance_mm + lens.pupil_mm) + (step if nearer else -step)
    if edge.mean() <= EDGE_SHARE or centre <= 0:
        return None
    distance = round(1 / centre - lens.pupil_mm)
    return distance if MIN_DISTANCE_MM <= distance <= MAX_DISTANCE_MM else None


def merge_depths(shots: Sequence[tuple[int, Floats]], pupil_mm: float) -> Floats:
    """(rows, cols, 3) mm of shots (distance, points): of each sample the one that lay nearest to the middle of its
    window, where the stripe lay in the middle of the block that is read out.
    """
    off = np.stack([np.abs(1 / -points[..., 2] - 1 / (distance + pupil_mm)) for distance, points in shots])
    best = np.argmin(np.where(np.isfinite(off), off, np.inf), axis=0)
    points = np.stack([points for _, points in shots])
    return np.asarray(np.take_along_axis(points, best[None, ..., None], axis=0)[0])

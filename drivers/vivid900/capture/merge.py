"""Combines shots of one scene, for less noise or for more depth."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import LENSES, Lens, Mode, depth_window
from drivers.vivid900.settings import MAX_DISTANCE_MM, MIN_DISTANCE_MM
from restore.scan import Floats

# A sample farther than this from the median over the shots is an outlier (mixed from two surfaces): six times the noise
# of a sample on carbon ink, which is 0.07 lines.
OUTLIER_LINES = 0.4
MAX_DEPTHS = 7  # shots of one page at different depths; seven TELE windows reach 0.3 m at 600 mm
OVERLAP = 0.15  # fraction of a window by which it overlaps its neighbour
EDGE_BAND = 0.06  # samples this close to the end of the window, as a fraction of it, suggest that the surface goes on …
MIN_WEIGHT = 0.05  # of a sample at the border of its window against one in focus
EDGE_FRACTION = 0.0005  # … when they are at least this fraction of all: 150 samples of a FINE shot


def average(frames: Sequence[Floats], mode: Mode) -> Floats:
    """Average shots of a static scene; N shots lower the noise by √N.

    A sample is the mean over the shots that measured it; outliers are dropped, and so is a sample on which the shots
    disagree without a majority. NaN where nothing is left. The speckle of laser light does not change while nothing
    moves: its part of the noise stays.
    Returns the mean pitch (rows, cols), frames.
    """
    if len(frames) == 1:
        return frames[0]
    stack = np.stack(frames)
    kept = np.abs(stack - _median(stack)) * mode.step <= OUTLIER_LINES  # never of NaN
    total, number = np.where(kept, stack, 0.0).sum(axis=0), kept.sum(axis=0)
    return np.divide(total, number, out=np.full(total.shape, np.nan), where=number > 0)


def _median(stack: Floats) -> Floats:
    """Compute the median (…) over the first axis, NaN without measurements.

    `np.nanmedian` takes several times as long.
    """
    ordered, count = np.sort(stack, axis=0), np.isfinite(stack).sum(axis=0)  # NaN comes last
    middles = (np.maximum(count - 1, 0) // 2, np.minimum(count // 2, len(stack) - 1))
    low, high = (np.take_along_axis(ordered, at[None], axis=0)[0] for at in middles)
    return np.asarray((low + np.where(count > 0, high, np.nan)) / 2)


def cover_depths(shoot: Callable[[int], Floats], distance_mm: int, lens: Lens, mode: Mode) -> list[tuple[int, Floats]]:
    """Take a shot, then nearer and farther ones while the surface extends.

    More shots are taken while the surface extends beyond the depth window.
    shoot: gives the points (rows, cols, 3) mm of a shot focused at a distance.
    Returns (distance in mm, points) of every shot, the given distance first.
    """
    taken = [(distance_mm, shoot(distance_mm))]
    for nearer in (True, False):
        distance, points = taken[0]
        while len(taken) < MAX_DEPTHS:
            following = next_depth(points, lens, mode, distance, nearer=nearer)
            if following is None:
                break
            distance, points = following, shoot(following)
            taken.append((distance, points))
    return taken


def next_depth(points: Floats, lens: Lens, mode: Mode, distance_mm: int, *, nearer: bool) -> int | None:
    """Return the distance of the next shot nearer or farther, mm.

    points: (rows, cols, 3) mm. Returns None when they do not reach that end of the depth window, or when the scanner
        cannot focus there.
    """
    near, far = depth_window(lens, mode, distance_mm)
    width, inverse = 1 / near - 1 / far, 1 / -points[..., 2]
    edge = inverse > 1 / near - EDGE_BAND * width if nearer else inverse < 1 / far + EDGE_BAND * width
    step = width * (1 - OVERLAP)
    centre = 1 / (distance_mm + lens.pupil_mm) + (step if nearer else -step)
    if edge.mean() <= EDGE_FRACTION or centre <= 0:
        return None
    distance = round(1 / centre - lens.pupil_mm)
    return distance if MIN_DISTANCE_MM <= distance <= MAX_DISTANCE_MM else None


def merge_depths(shots: Sequence[tuple[int, Floats]], calibration: Calibration, mode: Mode) -> Floats:
    """Merge shots (distance, points) focused at different distances.

    A sample that several shots measured is their mean, weighted by how central it is in each depth window, without a
    step where a window ends; outliers from the most central value are dropped.
    Returns (rows, cols, 3) mm.
    """
    if len(shots) == 1:
        return shots[0][1]
    points = np.stack([points for _, points in shots])
    lines = calibration.baseline_mm * calibration.focal_px / -points[..., 2]
    focus = [calibration.baseline_mm * calibration.focal_px / (d + calibration.pupil_mm) for d, _ in shots]
    off = np.abs(lines - np.array(focus)[:, None, None]) / (LENSES[calibration.lens].lines(mode) / 2)
    central = np.argmin(np.where(np.isfinite(off), off, np.inf), axis=0)[None]
    best = np.take_along_axis(lines, central, axis=0)
    weight = np.where(np.abs(lines - best) <= OUTLIER_LINES, np.maximum(1 - off**2, MIN_WEIGHT), 0.0)
    mean = np.nansum(weight * lines, axis=0) / np.where((weight > 0).any(axis=0), weight.sum(axis=0), np.nan)
    # All shots see a sample on one line of sight: the mean lies on it, too.
    along = np.take_along_axis(points, central[..., None], axis=0)[0]
    return np.asarray(along * (best[0] / mean)[..., None])

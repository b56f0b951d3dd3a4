"""Brings an organised cloud into the frame of a scanner.

Its X is right, its Y up, and the object lies at negative Z.

Files have y up or down, z forward or back, left-handed frames, and frames of a robot. Rows run down the picture and
columns to the right, as cameras read their sensors: where a coordinate runs the other way, it is reversed. So a page is
never mirrored, whatever the handedness of its file.
"""

from __future__ import annotations

import numpy as np

from restore.camera.rays import find_rays
from restore.errors import NotEnoughSurface
from restore.formats.clouds.cloud import SUBSET, Cloud
from restore.numerics.limits import TINY
from restore.numerics.robust import MAJORITY
from restore.range_image.resample import CAMERA_DISTANCE
from restore.scan import Floats, RangeScan


def in_scanner_frame(cloud: Cloud, step: int = 1) -> tuple[Floats, bool]:
    """Return the points (rows, cols, 3) of a cloud in a scanner's frame.

    step: from sample to sample of those that show where lines of sight meet. Returns also whether the columns were
    reversed.
    Where the lines of sight meet in the origin, or the viewpoint of the file, that is the scanner's lens; elsewhere
    the frame looks at the surface from there.
    """
    assert cloud.size is not None
    points = cloud.points.reshape(cloud.size[1], cloud.size[0], 3)
    posed = (cloud.points - cloud.viewpoint) @ cloud.axes.T
    for candidate in (points, posed.reshape(points.shape)):
        turned, mirrored = _along_axes(candidate)
        if turned is not None and _meet(turned[::step, ::step]):
            reverse = mirrored and cloud.frame == "right-handed"
            return (turned * [-1.0, 1.0, 1.0])[:, ::-1] if reverse else turned, reverse
    return _looking_at(points, cloud)


def _meet(points: Floats) -> bool:
    """Whether the samples (rows, cols, 3) lie on the lines of sight of one camera."""
    rows, cols, _ = points.shape
    try:
        with np.errstate(all="ignore"):  # of damaged coordinates
            return find_rays(RangeScan(points, None, np.zeros((rows, cols, 2)))) is not None
    except NotEnoughSurface:  # reported when a page is looked for
        return False


def _along_axes(points: Floats) -> tuple[Floats | None, bool]:
    """Return points (rows, cols, 3) in axes that run as columns and rows do.

    X runs along the columns, Y against the rows, Z to the scanner. Each is one of their own, reversed where
    needed. None where none of them leads away from the scanner. Returns also whether the handedness changed.
    """
    rows, cols, some = _some(points)
    third = int(np.argmax(np.abs(np.median(some, axis=1))))
    away = float(np.sign(np.median(some[third])))
    if not away or (np.sign(some[third]) != away).any():
        return None, False
    first, second = (axis for axis in range(3) if axis != third)
    with np.errstate(all="ignore"):  # of damaged coordinates
        x, y = some[[first, second]] / np.abs(some[third])
        related = np.nan_to_num(np.corrcoef([cols, rows, x, y])[:2, 2:])
    if abs(related[0, 1] * related[1, 0]) > abs(related[0, 0] * related[1, 1]):
        first, second, related = second, first, related[:, ::-1]
    signs = np.array([np.sign(related[0, 0]), -np.sign(related[1, 1]), -away])
    if not signs.all():
        return None, False
    axes = np.eye(3)[[first, second, third]] * signs[:, None]
    return points[..., [first, second, third]] * signs, bool(np.linalg.det(axes) < 0)


def _looking_at(points: Floats, cloud: Cloud) -> tuple[Floats, bool]:
    """Return points (rows, cols, 3) in a frame that looks at them.

    Returns also whether their columns were reversed.
    """
    _, _, some = _some(points)
    middle, size = some.mean(axis=1), float(np.ptp(some, axis=1).max())
    right = _mean_step(points, 1)
    away = _unit(np.cross(right, _mean_step(points, 0)))
    sight = some - cloud.viewpoint[:, None]
    ahead = (sight / np.maximum(np.linalg.norm(sight, axis=0), TINY)).mean(axis=1)
    from_viewpoint = bool(np.linalg.norm(ahead) > MAJORITY)  # else it is in their middle
    mirrored = from_viewpoint and float(away @ ahead) < 0.0
    if mirrored:
        away = -away
    reverse = mirrored and cloud.frame == "right-handed"
    across = _unit(right - (right @ away) * away) * (-1.0 if reverse else 1.0)
    axes = np.stack([across, np.cross(-away, across) * (-1.0 if mirrored and not reverse else 1.0), -away])
    origin = cloud.viewpoint if from_viewpoint else middle - CAMERA_DISTANCE * size * away
    turned = (points - origin) @ axes.T
    return turned[:, ::-1] if reverse else turned, reverse


def _some(points: Floats) -> tuple[Floats, Floats, Floats]:
    """Return rows and columns (n,) and coordinates (3, n) of some measured samples."""
    flat = np.flatnonzero(np.isfinite(points).all(axis=2))
    flat = flat[:: max(len(flat) // SUBSET, 1)]
    rows, cols = np.divmod(flat, points.shape[1])
    return rows.astype(float), cols.astype(float), points.reshape(-1, 3)[flat].T


def _mean_step(points: Floats, axis: int) -> Floats:
    """Return the median step (3,) from sample to sample along an axis."""
    steps = np.diff(points, axis=axis).reshape(-1, 3)
    known = steps[np.isfinite(steps).all(axis=1)]
    return np.asarray(np.median(known, axis=0)) if len(known) else np.eye(3)[1 - axis]


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / max(float(np.linalg.norm(vector)), TINY))

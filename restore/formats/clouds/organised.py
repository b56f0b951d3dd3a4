"""Range images of organised clouds, without flying pixels."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, sqrt
from pathlib import Path

import cv2
import numpy as np

from restore.camera.rays import MAX_SLOPE
from restore.findings import NOTABLE, Finding
from restore.formats.clouds.cloud import Cloud
from restore.formats.clouds.frame import in_scanner_frame
from restore.formats.parsing.grid import samples_in_picture
from restore.formats.parsing.picture import adjacent_picture
from restore.numerics.robust import MAJORITY, NEVER, robust_sigma
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, Ints, Mask, RangeScan, with_findings

# The largest grid is then as fine as a Vivid's, for which windows, bands and times are chosen.
MAX_SAMPLES = 2**19


def organised_scan(path: Path, cloud: Cloud, picture: Bytes | None) -> RangeScan:
    """Return the range image of an organised cloud in millimetres.

    picture: (h, w, 3), replaces its colours.
    Raises BadInput where the picture does not fit the grid.
    """
    assert cloud.size is not None
    cols, rows = cloud.size
    points, reversed_ = in_scanner_frame(cloud, coarsening(rows, cols))
    flying = flying_pixels(points)
    points[flying] = np.nan
    texture, places = _picture(path, cloud, picture, rows, cols)
    if reversed_:
        places = places[:, ::-1]
    scan = RangeScan(points, texture, places, cloud.provenance, findings=cloud.findings)
    return coarsened(with_findings(scan, *reported(flying, points)))


def _of_points(colours: Bytes, measured: Mask) -> Bytes:
    """Return the picture (rows, cols, 3) of the colours (n, 3) of points.

    Where missing points have one colour, which means none, that of the nearest measured one is taken.
    """
    missing = colours[~measured.ravel()]
    picture = colours.reshape(*measured.shape, 3)
    return colours[nearest_known(measured)] if len(missing) and (missing == missing[0]).all() else picture


def reported(flying: Mask, points: Floats) -> list[Finding]:
    """Return the finding of flying pixels (rows, cols) removed from points (rows, cols, 3)."""
    lost = float(flying.sum() / max(flying.sum() + np.isfinite(points[..., 2]).sum(), 1))
    return [Finding.of("flying_pixels", lost)] if lost > NOTABLE else []


def _picture(path: Path, cloud: Cloud, picture: Bytes | None, rows: int, cols: int) -> tuple[Bytes | None, Floats]:
    """Return the picture of a cloud and the positions (rows, cols, 2) of its points in it."""
    if picture is None and cloud.picture is not None:
        return cloud.picture[0], cloud.picture[1].reshape(rows, cols, 2)
    if picture is None and cloud.colours is not None:
        picture = _of_points(cloud.colours, cloud.measured.reshape(rows, cols))
    elif picture is None:
        picture = adjacent_picture(path)
    return picture, samples_in_picture(path, rows, cols, picture)


def flying_pixels(points: Floats) -> Mask:
    """Return the samples between a near and a far surface, on neither.

    A pixel that sees an edge mixes both depths. The lines to the samples before and behind it, along a row, a column or
    a diagonal, then run along the ray. Steps within the noise do not count.
    points: (rows, cols, 3) in a scanner's frame. Returns (rows, cols) bool.
    """
    depth = -points[..., 2]
    inner, least = depth[1:-1, 1:-1], NEVER * robust_sigma(_curvatures(depth))
    with np.errstate(all="ignore"):  # of damaged coordinates
        x, y = points[..., 0] / depth, points[..., 1] / depth

    @np.errstate(all="ignore")  # each thread has its own state
    def steep(way: tuple[int, int]) -> Mask:
        start, end = ((-way[0], -way[1]), way)
        step = np.minimum(np.abs(_shifted(depth, *start) - inner), np.abs(_shifted(depth, *end) - inner))
        turn = np.hypot(*(_shifted(axis, *end) - _shifted(axis, *start) for axis in (x, y)))
        return np.asarray((step > least) & (step > MAX_SLOPE / 2.0 * turn * np.abs(inner)))

    found = in_threads(steep, ((0, 1), (1, 0), (1, 1), (1, -1)))
    return np.pad(np.logical_or.reduce(found), 1)


def _shifted(values: Floats, down: int, right: int) -> Floats:
    rows, cols = values.shape[:2]
    return values[1 + down : rows - 1 + down, 1 + right : cols - 1 + right]


def _curvatures(depth: Floats) -> Floats:
    """Return second differences (n,) of depths along rows, in the scale of the noise of one."""
    second = (depth[:, 2:] - 2.0 * depth[:, 1:-1] + depth[:, :-2]) / sqrt(6.0)
    known = second[np.isfinite(second)]
    return known if len(known) else np.zeros(1)


def coarsening(rows: int, cols: int) -> int:
    """Return how many samples of a grid are averaged along a row, and along a column."""
    return ceil(sqrt(rows * cols / MAX_SAMPLES))


def coarsened(scan: RangeScan) -> RangeScan:
    """Return a range image of MAX_SAMPLES samples at most.

    Each is the mean of a square of its samples; a square with less than half of them is missing. The picture keeps its
    resolution.
    """
    rows, cols = scan.points.shape[:2]
    step = coarsening(rows, cols)
    if step == 1:
        return scan
    rows, cols = rows // step, cols // step

    def squares(values: Floats) -> Floats:
        return values[: rows * step, : cols * step].reshape(rows, step, cols, step, -1)

    known = scan.measured
    count: Floats = squares(known.astype(np.float64)).sum(axis=(1, 3))
    total: Floats = squares(np.where(known[..., None], scan.points, 0.0)).sum(axis=(1, 3))
    points = np.where(count > MAJORITY * step**2 - 0.5, total / np.maximum(count, 1.0), np.nan)
    facts = {**scan.provenance, "averaged": step}
    return replace(scan, points=points, texture_xy=squares(scan.texture_xy).mean(axis=(1, 3)), provenance=facts)


def nearest_known(known: Mask) -> Ints:
    """Return the index (rows, cols) of the nearest known pixel in the flat picture."""
    _, number = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )
    index = np.zeros(int(number.max()) + 1, np.int64)
    index[number[known]] = np.flatnonzero(known)
    return index[number]

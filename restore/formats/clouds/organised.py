"""Range images of organised clouds, without flying pixels."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, sqrt
from pathlib import Path

import numpy as np

from restore.camera.rays import MAX_SLOPE
from restore.findings import Finding
from restore.formats.clouds.cloud import Cloud
from restore.formats.clouds.frame import in_scanner_frame
from restore.formats.parsing.grid import samples_in_picture
from restore.formats.parsing.picture import adjacent_picture
from restore.numerics.robust import MAJORITY, NEVER, robust_sigma
from restore.scan import Bytes, Floats, Mask, RangeScan

# A window of 7 × 7 samples is then 3 mm of a page that fills the picture, and a page takes a second or two.
MAX_SAMPLES = 2**20


def organised_scan(path: Path, cloud: Cloud, picture: Bytes | None) -> RangeScan:
    """Return the range image of an organised cloud in millimetres.

    picture: (h, w, 3), replaces its colours.
    Raises BadInput where the picture does not fit the grid.
    """
    assert cloud.size is not None
    cols, rows = cloud.size
    points, reversed_ = in_scanner_frame(cloud)
    flying = flying_pixels(points)
    points[flying] = np.nan
    texture, places = _picture(path, cloud, picture, rows, cols)
    if reversed_:
        places = places[:, ::-1]
    scan = RangeScan(points, texture, places, cloud.provenance, findings=cloud.findings)
    lost = float(flying.sum() / max(cloud.measured.sum(), 1))
    return coarsened(replace(scan, findings=(*scan.findings, *_reported(lost))))


def _reported(lost: float) -> list[Finding]:
    return [Finding.of("flying_pixels", lost)] if lost > 0.0 else []


def _picture(path: Path, cloud: Cloud, picture: Bytes | None, rows: int, cols: int) -> tuple[Bytes | None, Floats]:
    """Return the picture of a cloud and the positions (rows, cols, 2) of its points in it."""
    if picture is None and cloud.picture is not None:
        return cloud.picture[0], cloud.picture[1].reshape(rows, cols, 2)
    if picture is None and cloud.colours is not None:
        picture = cloud.colours.reshape(rows, cols, 3)
    elif picture is None:
        picture = adjacent_picture(path)
    return picture, samples_in_picture(path, rows, cols, picture)


def flying_pixels(points: Floats) -> Mask:
    """Return the samples between a near and a far surface, on neither.

    A pixel that sees an edge mixes both depths. The line from the sample before it to the one behind it, along a row, a
    column or a diagonal, then runs along the ray, and so does each half of it. Steps within the noise do not count.
    points: (rows, cols, 3) in a scanner's frame. Returns (rows, cols) bool.
    """
    depth = -points[..., 2]
    flying = np.zeros(depth.shape, bool)
    inner = depth[1:-1, 1:-1]
    noise = robust_sigma(_curvatures(depth)) if depth.size else 0.0
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        before, behind = (_shifted(depth, step * down, step * right) for step in (-1, 1))
        here = inner - before, behind - inner
        start, end = (_shifted(points, step * down, step * right) for step in (-1, 1))
        with np.errstate(invalid="ignore", divide="ignore"):
            turn = (end / end[..., 2:] - start / start[..., 2:])[..., :2]
            limit = np.maximum(MAX_SLOPE * np.hypot(turn[..., 0], turn[..., 1]) * np.abs(inner) / 2.0, NEVER * noise)
            steep = (np.minimum(np.abs(here[0]), np.abs(here[1])) > limit) & (here[0] * here[1] > 0)
        flying[1:-1, 1:-1] |= steep
    return flying


def _shifted(values: Floats, down: int, right: int) -> Floats:
    rows, cols = values.shape[:2]
    return values[1 + down : rows - 1 + down, 1 + right : cols - 1 + right]


def _curvatures(depth: Floats) -> Floats:
    """Return second differences (n,) of depths along rows, in the scale of the noise of one."""
    second = (depth[:, 2:] - 2.0 * depth[:, 1:-1] + depth[:, :-2]) / sqrt(6.0)
    known = second[np.isfinite(second)]
    return known if len(known) else np.zeros(1)


def coarsened(scan: RangeScan) -> RangeScan:
    """Return a range image of MAX_SAMPLES samples at most.

    Each is the mean of a square of its samples; a square with less than half of them is missing. The picture keeps its
    resolution.
    """
    rows, cols = scan.points.shape[:2]
    step = ceil(sqrt(rows * cols / MAX_SAMPLES))
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

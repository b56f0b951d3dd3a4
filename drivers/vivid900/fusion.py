"""Several shots of one scene, made into one scan: repeated shots to lower the noise, focus steps to reach deeper.

The scanner stands still between the shots, so each sample looks along the same line in all of them and differs in
1/depth alone, where a line of the CCD is the same step everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np

from drivers.scanner import SettingsError
from drivers.vivid900.lenses import BASELINE_MM, LENSES, MODES, Lens, Mode
from restore.scan import Bytes, Floats, Mask, RangeScan

MOVED = 1e-6  # tangents, 0.001 mm at a metre; the lines of sight of one view agree to rounding
# The faintest ink that is measured at all is 3.6 times as noisy as paper, and five of its own sigmas shall pass.
OUTLIER_SIGMAS = 18.0
LEAST_WEIGHT = 0.05  # of a sample at the border of its window against one in focus
OVERLAP = 0.15  # of a window's lines that the next window sees as well: wider than the blur at its border
STANDS_STILL = "leave scanner and page where they are between the shots"


def average(scans: Sequence[RangeScan]) -> RangeScan:
    """The mean of N shots of a scene that did not move: their random noise falls by √N, drop-outs are filled from the
    shots that saw the sample, and a sample on which the shots contradict each other without a majority is left out.

    The speckle of laser light does not change while nothing moves; what it contributes to the noise stays.
    Raises SettingsError for no scans, or scans of different grids or views.
    """
    inverse_depth, sight = _stack(scans)
    shots = [scan.texture for scan in scans if scan.texture is not None]
    texture = np.rint(np.mean(shots, axis=0)).astype(np.uint8) if shots else None
    noted = {**scans[0].provenance, "averaged": len(scans)}
    return _scan(scans[0], sight, _mean(inverse_depth, np.ones_like(inverse_depth)), texture, noted)


def merge_depths(scans: Sequence[RangeScan]) -> RangeScan:
    """One scan of a scene that is deeper than the window of a single shot, from shots focused at several distances.

    A sample that several shots saw is their mean, weighted towards the shot in whose window it lies most central: at
    the border the stripe is half out of the block that is read. The colour image is that of the shot that measured
    most. Raises SettingsError for no scans, scans of different grids or views, or one that does not tell its distance.
    """
    inverse_depth, sight = _stack(scans)
    weight = np.stack([_centrality(scan, own) for scan, own in zip(scans, inverse_depth, strict=True)])
    fullest = max(scans, key=lambda scan: int(scan.measured.sum()))
    noted = {**fullest.provenance, "distances_mm": [scan.provenance["distance_mm"] for scan in scans]}
    return _scan(fullest, sight, _mean(inverse_depth, weight), fullest.texture, noted)


def focus_distances(lens: Lens, mode: Mode, near_mm: float, far_mm: float) -> tuple[float, ...]:
    """Distances from the front of the lens at which to focus, nearest first, so that the windows together cover the
    depths from near to far mm (from the front of the lens, too), each overlapping the next.

    Raises SettingsError unless 0 < near <= far.
    """
    if not 0 < near_mm <= far_mm:
        raise SettingsError(f"{near_mm} to {far_mm} mm is no range of depths", "give the nearer end first")
    nearest, farthest = _lines(lens) / (np.array([near_mm, far_mm]) + lens.pupil_mm)
    window = lens.lines(mode)
    spacing = window * (1 - OVERLAP)
    steps = max(ceil((nearest - farthest - window) / spacing), 0) + 1
    lines = (nearest + farthest) / 2 + ((steps - 1) / 2 - np.arange(steps)) * spacing
    return tuple(float(_lines(lens) / at - lens.pupil_mm) for at in lines)


def _stack(scans: Sequence[RangeScan]) -> tuple[Floats, Floats]:
    """(n, rows, cols) inverse depths and (rows, cols, 2) tangents of the common lines of sight."""
    if not scans:
        raise SettingsError("there are no scans to put together", "shoot at least once")
    if any(scan.points.shape != scans[0].points.shape for scan in scans):
        raise SettingsError("the scans are of different grids", "shoot all of them in one mode")
    points = np.stack([scan.points for scan in scans])
    inverse_depth = -1.0 / points[..., 2]
    sights = points[..., :2] * inverse_depth[..., None]
    low, high = np.fmin.reduce(sights), np.fmax.reduce(sights)
    if (high - low > MOVED).any():  # never true of NaN
        raise SettingsError("the scans were not taken from one place through one lens", STANDS_STILL)
    return inverse_depth, low


def _mean(inverse_depth: Floats, weight: Floats) -> Floats:
    """(rows, cols) weighted mean over the shots, without those far from the median; NaN where none is left."""
    seen = np.isfinite(inverse_depth)
    off_median = np.abs(inverse_depth - _median(inverse_depth, seen))
    repeated = off_median[seen & (seen.sum(axis=0) > 1)]
    noise = 1.4826 * float(np.median(repeated)) if len(repeated) else 0.0
    weight = np.where(off_median <= OUTLIER_SIGMAS * noise, weight, 0.0)
    total = weight.sum(axis=0)
    total[total == 0] = np.nan
    return np.asarray((np.where(seen, inverse_depth, 0.0) * weight).sum(axis=0) / total)


def _median(values: Floats, seen: Mask) -> Floats:
    """(…) median over the first axis, NaN where nothing was seen; `np.nanmedian` takes ten times as long."""
    ordered, count = np.sort(values, axis=0), seen.sum(axis=0)  # NaN comes last
    low, high = (
        np.take_along_axis(ordered, np.maximum(at, 0)[None], axis=0)[0] for at in ((count - 1) // 2, count // 2)
    )
    return np.where(count > 0, (low + high) / 2, np.nan)


def _centrality(scan: RangeScan, inverse_depth: Floats) -> Floats:
    """(rows, cols) weight of each sample: 1 in focus, falling to LEAST_WEIGHT at the border of the window."""
    try:
        lens, mode = LENSES[scan.provenance["lens"]], MODES[scan.provenance["mode"]]
        focus = 1 / (scan.provenance["distance_mm"] + lens.pupil_mm)
    except KeyError as error:
        raise SettingsError(f"a scan does not tell its {error}", "merge scans as the scanner gave them") from error
    off_centre = (inverse_depth - focus) * _lines(lens) / (lens.lines(mode) / 2)
    return np.asarray(np.maximum(1 - np.nan_to_num(off_centre) ** 2, LEAST_WEIGHT))


def _lines(lens: Lens) -> float:
    """Lines of the CCD by which the stripe moves for one unit, 1/mm, of 1/depth."""
    return lens.focal_px * BASELINE_MM


def _scan(
    like: RangeScan, sight: Floats, inverse_depth: Floats, texture: Bytes | None, provenance: Mapping[str, Any]
) -> RangeScan:
    depth = 1.0 / inverse_depth
    points = np.concatenate([sight * depth[..., None], -depth[..., None]], axis=-1)
    return replace(like, points=points, texture=texture, provenance=provenance)

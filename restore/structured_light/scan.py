"""From the captured patterns to a range image."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput, NotEnoughSurface
from restore.findings import Finding
from restore.numerics.robust import MAJORITY, robust_sigma
from restore.numerics.srgb import CLIPPED
from restore.range_image.segmentation.segment import MIN_FRACTION
from restore.scan import Bytes, Floats, Mask, Provenance, RangeScan
from restore.structured_light.decode import REACH, Axis, decode_axis, projected_light
from restore.structured_light.grid import ViewGrid, view_grid
from restore.structured_light.locate import locate
from restore.structured_light.rig import Rig
from restore.structured_light.triangulate import triangulate

EDGES_A_SAMPLE = 1.5  # of the pattern, to a sample: with fewer its noise is that of its neighbours
RADIUS = 0.75  # of the window round a sample, in samples: a third of its edges are the next one's, too
OUTLIER_SIGMAS = 5.0  # of the epipolar residual: four lose a hundredth of the samples, where stripes are blurred
MIN_EPIPOLAR = 0.05  # projector pixels: least limit, or exact data would be all outliers
MAX_EPIPOLAR = 2.0  # projector pixels, of most samples: calibrations come within one
MAX_CLIPPED = 0.2  # of the lit pixels

DARK_HINT = (
    "darken the room, let the projector fill the camera's view, and expose so that the white image is bright; "
    "give the images in the order in which the patterns were shown, white and black at the end"
)
CALIBRATION_HINT = "calibrate camera and projector as they stand now, in millimetres, with images of this size"


def scan_captures(pictures: Sequence[Bytes], colour: Bytes, rig: Rig) -> RangeScan:
    """The range image of a surface that a projector lit with its patterns.

    pictures  (h, w) uint8 brightness of each pattern, in the order of `Projector.patterns`.
    colour    (h, w, 3) uint8 RGB of the white pattern: the texture.
    Raises BadInput for another number of pictures, or a calibration that does not belong to them, NotEnoughSurface when
    they show too little of the patterns.
    """
    _check(pictures, rig)
    height, width = pictures[0].shape
    white, black = pictures[-2:]
    if float(white.mean()) < float(black.mean()):
        raise BadInput("the last image is brighter than the one before it", "the order is: patterns, white, black")
    light = projected_light(white, black)
    columns, rows = _axes(pictures, light.level, rig)
    least_spacing = EDGES_A_SAMPLE * max(_edge_spacing(columns), _edge_spacing(rows))
    grid = view_grid(rig.camera, (width, height), least_spacing)
    found = _located(columns, rows, light.lit, grid)
    depth, residual = triangulate(rig, grid.tangents, found)
    kept = _consistent(depth, residual, light.lit)
    points = (
        np.dstack([grid.tangents, np.ones(depth.shape)]) * [1.0, -1.0, -1.0] * np.where(kept, depth, np.nan)[..., None]
    )
    frame = _frame(kept)
    facts = _provenance(rig, len(pictures), light.lit, kept, residual)
    clipped = float((white[light.lit] >= CLIPPED).mean())
    findings = (Finding.of("overexposed", clipped),) if clipped > MAX_CLIPPED else ()
    return RangeScan(np.ascontiguousarray(points[frame]), colour, grid.pixels[frame].copy(), facts, findings=findings)


def _check(pictures: Sequence[Bytes], rig: Rig) -> None:
    projector = rig.projector
    if len(pictures) != projector.count:
        raise BadInput(
            f"{len(pictures)} images: the patterns of a projector of {projector.width} × {projector.height} "
            f"pixels are {projector.count}",
            "capture every pattern once, with white and black at the end",
        )
    height, width = pictures[0].shape
    if rig.size is not None and rig.size != (width, height):
        raise BadInput(
            f"the calibration is of images of {rig.size[0]} × {rig.size[1]}, these have {width} × {height}",
            CALIBRATION_HINT,
        )
    centre = rig.camera.matrix[:2, 2]
    if not ((centre > 0) & (centre < [width, height])).all():
        raise BadInput(
            f"the calibration's principal point ({centre[0]:.0f}, {centre[1]:.0f}) lies outside images of "
            f"{width} × {height}",
            CALIBRATION_HINT,
        )


def _axes(pictures: Sequence[Bytes], level: NDArray[np.float32], rig: Rig) -> tuple[Axis, Axis]:
    pairs = list(zip(pictures[:-2:2], pictures[1:-2:2], strict=True))
    split = rig.projector.bits[0]
    return decode_axis(pairs[:split], level, rig.projector.width), decode_axis(
        pairs[split:], level, rig.projector.height
    )


def _located(columns: Axis, rows: Axis, lit: Mask, grid: ViewGrid) -> Floats:
    """Return projector pixels (rows, cols, 2) of a grid's samples, NaN where undetermined."""
    places = grid.pixels.reshape(-1, 2)
    found = np.empty_like(places)
    for k, axis in enumerate((columns, rows)):
        found[:, k] = locate(axis, lit, places, RADIUS * grid.spacing, grid.spacing / 2 + REACH)
    return found.reshape(grid.pixels.shape)


def _edge_spacing(axis: Axis) -> float:
    """Return the camera pixels between pattern edges, in the direction of densest edges."""
    edges = max(int(np.isfinite(crossings).sum()) for crossings in (axis.across, axis.down))
    return float((axis.code >= 0).sum() / edges) if edges else 1.0


def _consistent(depth: Floats, residual: Floats, lit: Mask) -> Mask:
    """Return the samples whose column and row agree on one place.

    The place is before the camera. Raises NotEnoughSurface or BadInput when they are too few, or agree nowhere. Returns
    (rows, cols) bool.
    """
    known = np.isfinite(residual)
    if known.mean() < MIN_FRACTION:
        raise NotEnoughSurface(
            f"the patterns can be read at {known.mean():.1%} of the image, and {lit.mean():.0%} of it is lit",
            DARK_HINT,
        )
    middle = float(np.median(residual[known]))
    typical = float(np.median(np.abs(residual[known])))
    if typical > MAX_EPIPOLAR or float(np.mean(depth[known] > 0)) < 0.5:
        raise BadInput(
            f"the calibration does not fit: lines of sight pass each other by {typical:.1f} pixels of the projector",
            CALIBRATION_HINT,
        )
    limit = max(OUTLIER_SIGMAS * robust_sigma(residual[known] - middle), MIN_EPIPOLAR)
    return known & (np.abs(residual - middle) < limit) & (depth > 0)


def _frame(kept: Mask) -> tuple[slice, slice]:
    """Return the rows and columns that the projector's picture fills.

    Beyond them nothing can be measured.
    """
    frame = []
    for axis in (1, 0):
        count = kept.sum(axis=axis)
        full = np.flatnonzero(count >= MAJORITY * count.max())  # the rest is outside the projector's picture
        frame.append(slice(int(full[0]), int(full[-1]) + 1))
    return frame[0], frame[1]


def _provenance(rig: Rig, count: int, lit: Mask, kept: Mask, residual: Floats) -> Provenance:
    return {
        "device": "structured light",
        "projector": [rig.projector.width, rig.projector.height],
        "captures": count,
        "baseline_mm": float(np.linalg.norm(rig.shift)),
        "lit_fraction": float(lit.mean()),
        "decoded_fraction": float(kept.mean()),
        "epipolar_px": float(np.sqrt(np.mean(residual[kept] ** 2))),
    }

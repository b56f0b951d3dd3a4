"""Range images of loose clouds, which end where the points end.

Their grid is that of a camera in front of the surface, with two points in a cell, whose mean is its depth. So passes
that overlap and noise average out as in a range image.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from math import ceil, cos, sin, sqrt
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from restore.camera.rays import MAX_GAP, MAX_SLOPE, STEEP
from restore.errors import BadInput
from restore.formats.clouds.cloud import Cloud
from restore.formats.clouds.organised import flying_pixels, nearest_known, reported
from restore.formats.parsing.picture import SMALL_PIXELS
from restore.numerics.limits import SINGLE_TINY
from restore.numerics.robust import NEARLY_ALL
from restore.range_image.resample import CAMERA_DISTANCE, MAX_GRID, MAX_TILT
from restore.scan import Bytes, Floats, Ints, Mask, RangeScan
from restore.settings import MIN_POINTS

COARSE = 64  # cells along the longer side, on which density is measured
IN_CELL = 2.0  # points: of random ones one cell in seven is empty, which a page goes on over
COVERED = 0.75  # cells from a centre to the middle of its points, where the edge of a half-plane runs through it
MARGIN = 2 * MAX_GAP  # empty cells around the surface: it ends there, and not at the frame of a picture
MESH_IT = "mesh the cloud in the scanner's program, and give the mesh"


@dataclass(frozen=True, eq=False)
class View:
    """Points from a camera in front of their surface.

    places  (n, 2) column and row in cells of a grid, with fractions.
    inverse (n,) inverse depth, 1/mm.
    shape   rows and columns of the grid.
    low     (2,) tangents x/depth and y/depth of the first cell, y up.
    pitch   tangent from cell to cell.
    """

    places: Floats
    inverse: Floats
    shape: tuple[int, int]
    low: Floats
    pitch: float


def loose_scan(path: Path, cloud: Cloud) -> RangeScan:
    """Return the range image of a loose cloud in millimetres, as one view shows it.

    Raises BadInput where no view shows most of it.
    """
    measured = cloud.measured
    points = cloud.points[measured]
    if len(points) < MIN_POINTS or np.ptp(points, axis=0).max() <= 0:
        raise BadInput(f"{path} holds {len(points)} points, which are not a surface", MESH_IT)
    view = _view(points @ _axes(cloud, points).T)
    inverse, off = _sampled(view)
    if off > 1.0 - NEARLY_ALL:
        raise BadInput(f"{path}: no single view shows its surface: {off:.0%} of the points lie behind it", MESH_IT)
    rows, cols = view.shape
    col, row = np.meshgrid(np.arange(cols), np.arange(rows))
    with np.errstate(divide="ignore"):
        depth = 1.0 / inverse
    x, y = (view.low[0] + view.pitch * col) * depth, (view.low[1] - view.pitch * row) * depth
    texture, places = _picture(cloud, measured, view)
    surface = np.dstack([x, y, -depth])
    flying = flying_pixels(surface)
    surface[flying] = np.nan
    found = (*cloud.findings, *reported(flying, surface))
    return RangeScan(surface, texture, places, cloud.provenance, findings=found)


def _axes(cloud: Cloud, points: Floats) -> Floats:
    """Return axes (3, 3), in rows: right, up and back of a camera in front of points (n, 3).

    The camera is on the side of the normals, or of the viewpoint of the file. Up is the frame's own: −y where the
    camera looks along z, y where it looks against it, z elsewhere.
    """
    middle = np.median(points, axis=0)
    back = np.linalg.svd(np.cov((points - middle).T))[2][2]
    side = cloud.viewpoint - middle
    if cloud.normals is not None:
        normals = cloud.normals[cloud.measured]
        side = np.nan_to_num(normals).sum(axis=0)
    back = back if float(back @ side) >= 0.0 else -back
    along = int(np.argmax(np.abs(back)))
    up = np.array([0.0, np.sign(back[2]), 0.0]) if along == 2 else np.array([0.0, 0.0, 1.0])
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(back, right), back])
    return np.asarray(_tilt(points @ axes.T) @ axes)


def _tilt(posed: Floats) -> Floats:
    """Return the rotation (3, 3) in the picture by which sides cross the rows, by least."""
    values, vectors = np.linalg.eigh(np.cov(posed[:, :2].T))
    axis = float(np.arctan2(*vectors[::-1, 1])) if values[1] > values[0] else 0.0
    angle = float(np.remainder(MAX_TILT - axis + np.pi / 4, np.pi / 2) - np.pi / 4)
    return np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])


def _view(posed: Floats) -> View:
    """Return points (n, 3) in axes of a camera, on the grid that their density suits."""
    posed = posed - np.median(posed, axis=0)
    size = float(np.ptp(posed, axis=0).max())
    depth = CAMERA_DISTANCE * size + posed[:, 2].max() - posed[:, 2]
    tangents = posed[:, :2] / depth[:, None]
    low, extent = tangents.min(axis=0), np.ptp(tangents, axis=0)
    pitch = max(_spacing(tangents, low, float(extent.max())), float(extent.max()) / MAX_GRID)
    cols, rows = (ceil(side / pitch) + 2 * MARGIN for side in extent)
    first = np.array([low[0] - MARGIN * pitch, low[1] + (rows - 1 - MARGIN) * pitch])
    places = np.stack([(tangents[:, 0] - first[0]) / pitch, (first[1] - tangents[:, 1]) / pitch], axis=1)
    return View(places, 1.0 / depth, (rows, cols), first, pitch)


def _spacing(tangents: Floats, low: Floats, extent: float) -> float:
    """Return the distance of neighbours where they are sparse, as a tangent."""
    cell = extent / COARSE
    col, row = np.minimum((tangents - low) / cell, COARSE - 1).astype(np.int64).T
    counts = np.bincount(row * COARSE + col, minlength=COARSE**2)
    inner = counts[counts > IN_CELL]
    return float(cell * sqrt(IN_CELL / np.quantile(inner, 1.0 - NEARLY_ALL))) if len(inner) else cell


def _sampled(view: View) -> tuple[Floats, float]:
    """Return the inverse depth (rows, cols) of cells, NaN beyond the points.

    That of the middle of a cell follows from the mean of its points and the slope to its neighbours. Returns also which
    fraction of the points is not of the layer that most of their cell are of.
    """
    rows, cols = view.shape
    cell = np.rint(view.places).astype(np.int64)
    number = cell[:, 1] * cols + cell[:, 0]
    near = _of_layer(number, view)
    number, (u, v) = number[near], (view.places - cell)[near].T
    terms: tuple[Floats, ...] = (np.ones(len(u)), u, v, view.inverse[near])
    sums = (np.bincount(number, term, rows * cols).reshape(rows, cols).astype(np.float64) for term in terms)
    count, x, y, inverse = sums
    covered = _covered(count, x, y)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, inverse = x / count, y / count, inverse / count
        limit = STEEP * view.pitch * inverse
        value = inverse - x * _slope(inverse, x, limit) - y * _slope(inverse.T, y.T, limit.T).T
    return np.where(covered, value, np.nan), float(1.0 - near.mean())


def _of_layer(number: Ints, view: View) -> Mask:
    """Return the points (n,) near the median of their cell, whose numbers (n,) are given."""
    order = np.lexsort((view.inverse, number))
    first = np.flatnonzero(np.diff(number[order], prepend=-1))
    count = np.diff(first, append=len(order))
    median = np.full(view.shape[0] * view.shape[1], np.nan)
    median[number[order[first]]] = view.inverse[order[first + count // 2]]
    return np.asarray(np.abs(view.inverse - median[number]) <= MAX_SLOPE * view.pitch * view.inverse)


def _covered(count: Floats, x: Floats, y: Floats) -> Mask:
    """Return which cells have points, and points around them up to their middle.

    count, x, y: (rows, cols), number of points and sums of their places from the middle of their cell.
    """
    shifted = np.pad(np.stack([count, x, y]), ((0, 0), (1, 1), (1, 1)))
    n, right, down = (np.zeros_like(count) for _ in range(3))
    for i, j in itertools.product((-1, 0, 1), repeat=2):
        some = shifted[:, 1 + i : 1 + i + count.shape[0], 1 + j : 1 + j + count.shape[1]]
        n += some[0]
        right += some[1] + j * some[0]
        down += some[2] + i * some[0]
    return np.asarray((count > 0) & (np.hypot(right, down) <= COVERED * n))


def _slope(inverse: Floats, x: Floats, limit: Floats) -> Floats:
    """Return the change (rows, cols) of inverse depth along a row, 0 across steps."""
    change = np.diff(inverse) / (1.0 + np.diff(x))
    change[~(np.abs(change) <= limit[:, 1:])] = np.nan
    both = np.stack([np.pad(change, ((0, 0), side), constant_values=np.nan) for side in ((1, 0), (0, 1))])
    known = np.isfinite(both)
    return np.asarray(np.where(known, both, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def _picture(cloud: Cloud, measured: Mask, view: View) -> tuple[Bytes | None, Floats]:
    """Return the picture of the colours of points.

    It has two pixels from point to point, so that a point is where it was. Returns also the positions (rows, cols, 2)
    of the cells in it.
    """
    rows, cols = view.shape
    col, row = np.meshgrid(np.arange(cols, dtype=float), np.arange(rows, dtype=float))
    if cloud.colours is None:
        return None, np.dstack([col, row])
    cells = np.unique(np.rint(view.places).astype(np.int64) @ [1, cols])
    most = min(SMALL_PIXELS, 16 * len(view.places))  # four times as many as are wanted, where points are in few cells
    finer = min(max(2.0 * sqrt(len(view.places) / len(cells)), 1.0), max(sqrt(most / (rows * cols)), 1.0))
    height, width = ceil(rows * finer), ceil(cols * finer)
    at = np.rint(view.places * finer).astype(np.int64)
    number = at[:, 1].clip(0, height - 1) * width + at[:, 0].clip(0, width - 1)
    parts = [None, *cloud.colours[measured].T]
    sums = (np.bincount(number, part, height * width).reshape(height, width).astype(np.float32) for part in parts)
    weight, *channels = (_blurred(part) for part in sums)
    nearest = nearest_known(weight > SINGLE_TINY)
    mean = np.stack([channel / np.maximum(weight, SINGLE_TINY) for channel in channels], axis=-1)
    return np.clip(np.rint(mean), 0, 255).astype(np.uint8).reshape(-1, 3)[nearest], np.dstack([col, row]) * finer


def _blurred(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Average over a pixel either way: half of the distance of points."""
    return np.asarray(cv2.GaussianBlur(values, (0, 0), 1.0))

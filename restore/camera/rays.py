"""The lines of sight of a scanner, fitted to the scan itself.

The errors of a laser range scanner are along its lines of sight, and the inverse depth 1/D of a plane is an affine
function of the pixel. So the whole preparation works on inverse depth over pixels, and needs the line of sight of each
pixel. Lens distortion violates this by less than the noise in the small windows where it is assumed; positions and
lengths are computed with distortion.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from restore.errors import NotEnoughSurface
from restore.scan import Floats, Ints, RangeScan
from restore.settings import MIN_POINTS

# Samples. Those of a scan written with two decimals scatter by a hundredth to a fiftieth, of an export of the scanner's
# own software by 0.06; merged or moved views scatter by whole samples.
MAX_SCATTER = 0.1
# 45°: a shadow of the laser ends on its ray, steeper than that for any baseline that is shorter than the distance.
STEEP = 1.0
MAX_SLOPE = 6.0  # 80.5°: steeper than any wall that both camera and laser see, less steep than the step to the table
ASPECT_TOLERANCE = 0.01  # grid and picture are of one camera: a row or column in 100 more is still the same view
EDGE_BLUR = 3  # samples over which lens and drop-outs blur the edge of the sheet
MAX_GAP = 2  # samples: drop-outs inside ink leave gaps of one or two
MIN_DISTORTION_GAIN = 0.005  # samples: least reduction of the scatter for which lens distortion is fitted
SUBSET_STRIDE = 7  # every seventh sample determines six unknowns well enough
DISTORTION_ITERATIONS = 8  # each divides the error by ten or more for a lens that shifts the corners by up to 5 %

LensTerms = tuple[float, float, float, float, float, float]


def distortion_factor(squared_radius: Any, k1: float, k2: float) -> Any:
    """Return the radial distortion factor 1 + k1·r² + k2·r⁴.

    The undistorted radius r is found by fixed-point iteration.
    squared_radius: (…), distorted.
    """
    factor = 1.0 + 0.0 * squared_radius
    if k1 == 0.0 and k2 == 0.0:
        return factor
    for _ in range(DISTORTION_ITERATIONS):
        undistorted = squared_radius / (factor * factor)
        factor = 1.0 + undistorted * (k1 + k2 * undistorted)
    return factor


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of a camera through the samples of a grid.

    Without distortion, sample (row, col) has the direction (x0 + dx·col, y0 + dy·row, −1).
    distortion: (k1, k2) of the lens: the direction (x, y, −1) is imaged at (x, y)·(1 + k1·r² + k2·r⁴), with r² = x² +
        y² (Brown 1966).
    axes: (3, 3), rows right, up and back of the camera; the scanner's by default.
    origin: (3,) mm, the camera's centre; the scanner's by default.
    """

    x0: float
    dx: float
    y0: float
    dy: float
    axes: Floats = field(default_factory=lambda: np.eye(3))
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    distortion: tuple[float, float] = (0.0, 0.0)

    @property
    def lens(self) -> LensTerms:
        """x0, dx, y0, dy, k1, k2."""
        return self.x0, self.dx, self.y0, self.dy, *self.distortion

    def points(self, rows: Floats, cols: Floats, inverse_depth: Floats) -> Floats:
        """Return surface points (…, 3) mm at grid positions.

        rows, cols: (…), fractions allowed.
        inverse_depth: (…) 1/mm.
        """
        depth = 1.0 / inverse_depth
        x, y = self.x0 + self.dx * cols, self.y0 + self.dy * rows
        scale = depth / distortion_factor(x**2 + y**2, *self.distortion)
        return np.stack([x * scale, y * scale, -depth], axis=-1) @ self.axes + self.origin

    def grid(self, points: Floats) -> tuple[Floats, Floats]:
        """Grid position (rows, cols), as fractions, of points (…, 3) mm."""
        x, y, z = np.moveaxis((points - self.origin) @ self.axes.T, -1, 0)
        return self.in_picture(x / -z, y / -z)

    def in_picture(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Return the grid positions of directions (x, y, −1).

        x, y: (…), in the camera's frame. Returns rows and cols (…), with fractions.
        """
        squared, (k1, k2) = x**2 + y**2, self.distortion
        factor = 1.0 + squared * (k1 + k2 * squared)
        return (y * factor - self.y0) / self.dy, (x * factor - self.x0) / self.dx


def find_rays(scan: RangeScan) -> Rays | None:
    """Fit the rays of one camera to the samples of a scan.

    Returns None when the samples do not lie on such rays. Raises NotEnoughSurface when there are too few samples for a
    fit.
    """
    rows, cols = np.nonzero(scan.measured)
    if len(rows) < MIN_POINTS or np.ptp(rows) < 2 or np.ptp(cols) < 2:
        raise NotEnoughSurface(
            f"the scan holds {len(rows)} samples, a page takes {MIN_POINTS} and more",
            "check laser power, distance and lens, and scan again; export a mesh with more vertices",
        )
    x, y, z = scan.points[rows, cols].T
    if z.max() >= 0:
        return None
    x, y = x / -z, y / -z
    rays = Rays(*_fit_line(cols, x), *_fit_line(rows, y))
    scatter = _scatter(rays, rows, cols, x, y)
    if scatter > MIN_DISTORTION_GAIN:
        subset = np.s_[::SUBSET_STRIDE]
        distorted = _fit_lens(rows[subset], cols[subset], x[subset], y[subset])
        rays, scatter = min(
            (rays, scatter),
            (distorted, _scatter(distorted, rows, cols, x, y) + MIN_DISTORTION_GAIN),
            key=lambda fit: fit[1],
        )
    return rays if rays.dx > 0 and rays.dy < 0 and scatter < MAX_SCATTER else None


def _fit_line(places: Ints, values: Floats) -> tuple[float, float]:
    """Fit a line to values (n,) at places (n,); return its value at 0 and its slope."""
    middle, mean = float(places.mean()), float(values.mean())
    off = places - middle
    slope = float((off * values).sum() / (off * off).sum())
    return mean - slope * middle, slope


def _fit_lens(rows: Ints, cols: Ints, x: Floats, y: Floats) -> Rays:
    """Fit rays with distortion, by linear least squares, to (x, y, −1) (n,) at pixels (n,).

    Both equations are linear in the parameters: x·(1 + k1·r² + k2·r⁴) = x0 + dx·col.
    """
    squared, zeros, ones = x**2 + y**2, np.zeros(len(x)), np.ones(len(x))
    equations_x = np.stack([ones, cols, zeros, zeros, -x * squared, -x * squared**2], axis=1)
    equations_y = np.stack([zeros, zeros, ones, rows, -y * squared, -y * squared**2], axis=1)
    fit, *_ = np.linalg.lstsq(np.concatenate([equations_x, equations_y]), np.concatenate([x, y]), rcond=None)
    x0, dx, y0, dy, k1, k2 = map(float, fit)
    return Rays(x0, dx, y0, dy, distortion=(k1, k2))


def _scatter(rays: Rays, rows: Ints, cols: Ints, x: Floats, y: Floats) -> float:
    """Return the reprojection error in samples, 1σ of the worse axis.

    x, y: (n,), directions (x, y, −1), at grid positions (n,).
    """
    predicted_rows, predicted_cols = rays.in_picture(x, y)
    return float(max(np.std(predicted_rows - rows), np.std(predicted_cols - cols)))

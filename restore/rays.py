"""The scanner's lines of sight, found from the scan itself.

A laser range scanner errs along its lines of sight only, and in a plane's inverse depth 1/D is an affine function of
the pixel. So the whole preparation works on inverse depth over pixels, and needs to know where each pixel looks.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from restore.errors import NotEnoughSurface
from restore.scan import Floats, RangeScan

# The rays of a scan written with two decimals (0.01 mm at 900 mm) scatter by a hundredth of a sample; merged or moved
# views scatter by whole samples.
MAX_SCATTER = 0.1
MIN_SAMPLES = 50


@dataclass(frozen=True, eq=False)
class Rays:
    """A pinhole: in its own frame sample (row, col) looks along (x0 + dx·col, y0 + dy·row, −1).

    axes (3, 3) rows right, up and back of the pinhole, and origin (3,) mm its place: the scanner itself by default.
    """

    x0: float
    dx: float
    y0: float
    dy: float
    axes: Floats = field(default_factory=lambda: np.eye(3))
    origin: Floats = field(default_factory=lambda: np.zeros(3))

    def points(self, rows: Floats, cols: Floats, inverse_depth: Floats) -> Floats:
        """(…, 3) mm: the surface points that grid positions (fractions allowed) see at 1/D (…) per mm."""
        depth = 1.0 / inverse_depth
        own = np.stack([(self.x0 + self.dx * cols) * depth, (self.y0 + self.dy * rows) * depth, -depth], axis=-1)
        return own @ self.axes + self.origin

    def grid(self, points: Floats) -> tuple[Floats, Floats]:
        """Grid position (rows, cols), as fractions, of points (…, 3) mm."""
        x, y, z = np.moveaxis((points - self.origin) @ self.axes.T, -1, 0)
        return (y / -z - self.y0) / self.dy, (x / -z - self.x0) / self.dx


def find_rays(scan: RangeScan) -> Rays | None:
    """Fit the pinhole that took the scan, or None when its samples do not lie on the rays of one pinhole.

    Raises NotEnoughSurface when there are too few samples to tell.
    """
    rows, cols = np.nonzero(scan.measured)
    if len(rows) < MIN_SAMPLES or np.ptp(rows) < 2 or np.ptp(cols) < 2:
        raise NotEnoughSurface(
            f"the scan holds {len(rows)} samples", "check laser power, distance and lens, and scan again"
        )
    x, y, z = scan.points[rows, cols].T
    if z.max() >= 0:
        return None
    dx, x0 = np.polyfit(cols, x / -z, 1)
    dy, y0 = np.polyfit(rows, y / -z, 1)
    if dx <= 0 or dy >= 0:
        return None
    scatter = max(np.std(x / -z - x0 - dx * cols) / dx, np.std(y / -z - y0 - dy * rows) / -dy)
    return Rays(float(x0), float(dx), float(y0), float(dy)) if scatter < MAX_SCATTER else None

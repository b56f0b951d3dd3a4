"""Small shots of a curved sheet, exact to the last bit, as the camera would see it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from restore.formats.parsing.grid import grid_polygons
from restore.formats.parsing.mesh import fan_triangles
from restore.scan import RangeScan, SurfaceMesh

MIDDLE_PX = 1942.8  # focal length of the MIDDLE lens in pixels of the 640 × 480 image
IMAGE_SIZE = (640, 480)


def make_shot(
    rows: int = 12, cols: int = 16, *, thinned: int = 1, missing: float = 0.1, whole: bool = False, seed: int = 0
) -> RangeScan:
    """A sheet with a swell, 700 mm away, seen on a part of the MIDDLE lens's grid.

    thinned  image pixels per sample. whole  the picture shows just this grid, not the whole image. missing  share of
    samples without a measurement.
    """
    rng = np.random.default_rng(seed)
    first = np.array([0, 0] if whole else [300, 220])  # column and row of the image where the grid starts
    width, height = (cols * thinned, rows * thinned) if whole else IMAGE_SIZE
    col, row = np.meshgrid(np.arange(cols), np.arange(rows))
    pixels = first + (np.stack([col, row], axis=-1) + 0.5) * thinned - 0.5
    rays = (pixels - [319.5, 239.5]) / MIDDLE_PX
    depth = 700.0 + 2.0 * np.sin(0.4 * col) + 0.7 * row + rng.normal(0, 0.02, (rows, cols))
    points = np.stack([rays[..., 0] * depth, -rays[..., 1] * depth, -depth], axis=-1)
    points[rng.random((rows, cols)) < missing] = np.nan
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    texture = np.stack([x, y, 3 * x + 5 * y], axis=-1).astype(np.uint8)
    return RangeScan(points, texture, pixels, {"lens": "MIDDLE", "distance_mm": 700.0})


def as_mesh(scan: RangeScan) -> SurfaceMesh:
    """The quads and triangles between the samples of a scan, split to triangles; every measured sample is a vertex."""
    quads, triangles = grid_polygons(scan.measured)
    corners = np.arange(0, quads.size, 4)
    faces = np.concatenate([fan_triangles(quads.ravel(), corners, np.full(len(quads), 4)), triangles])
    seen = scan.measured
    return SurfaceMesh(scan.points[seen], faces, scan.texture_xy[seen], scan.texture)


@pytest.fixture
def shot() -> Callable[..., RangeScan]:
    return make_shot


@pytest.fixture
def mesh() -> Callable[..., SurfaceMesh]:
    def make(**options: object) -> SurfaceMesh:
        return as_mesh(make_shot(**options))  # type: ignore[arg-type]

    return make

"""What a pinhole sees of planes, roofs and cylinders, exact to the last bits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numba
import numpy as np
import pytest

from oracles.warped import Warped, make_warped
from restore import Settings, restore
from restore.camera.rays import Rays
from restore.range_image.facets.sheet import Sheet
from restore.scan import Bytes, Floats, Mask, RangeScan, SurfaceMesh

FOCAL_PX = 1942.8  # MIDDLE lens of the VIVID 910, from the fields of view in its hardware manual p. 26
BASELINE_MM = 250.0  # the same manual's dimension drawing, p. 58
DISTANCE_MM = 921.5  # 0.9 m before the front of the lens
MIN_NOISE = 1e-9  # 1/mm: far below any slope here, so that every crease counts
NOISE_LINES = 0.02  # the manual's precision of Z (p. 60) in lines of the sensor, the same for all three lenses


@dataclass(frozen=True)
class Camera:
    """A part of the MIDDLE lens's picture, `rows` × `cols` samples round its centre, 0.47 mm apart on the page."""

    rows: int = 160
    cols: int = 200

    # One line of the sensor is a step of inverse depth, everywhere the same: 1.75 mm at 0.9 m.
    line = 1.0 / (FOCAL_PX * BASELINE_MM)
    noise = NOISE_LINES * line
    pitch_mm = DISTANCE_MM / FOCAL_PX

    @property
    def shape(self) -> tuple[int, int]:
        return self.rows, self.cols

    @property
    def rays(self) -> Rays:
        return Rays(-(self.cols - 1) / 2 / FOCAL_PX, 1 / FOCAL_PX, (self.rows - 1) / 2 / FOCAL_PX, -1 / FOCAL_PX)

    @property
    def indices(self) -> tuple[Floats, Floats]:
        rows, cols = np.indices(self.shape).astype(float)
        return rows, cols

    @property
    def directions(self) -> Floats:
        """(rows, cols, 3) lines of sight, one millimetre deep."""
        return self.rays.points(*self.indices, np.ones(self.shape))

    def plane(self, normal: tuple[float, float, float] = (0, 0, 1), distance: float = DISTANCE_MM) -> Floats:
        """Inverse depth (rows, cols) of the plane with this normal through (0, 0, −distance)."""
        return self.directions @ np.asarray(normal, float) / (-distance * normal[2])

    def walls(self, fold_deg: float, angle_deg: float, column: float) -> tuple[Floats, Floats]:
        """Two planes that fold away from the scanner by `fold_deg`.

        They meet at a ridge that runs at angle_deg from the picture's vertical, past the middle row at `column`.
        """
        half, angle = np.deg2rad(fold_deg) / 2, np.deg2rad(angle_deg)
        across = np.array([np.cos(angle), np.sin(angle), 0.0])
        start = self.rays.points(np.array((self.rows - 1) / 2), np.array(column), np.array(1 / DISTANCE_MM))
        left, right = (np.cos(half) * np.array([0, 0, 1.0]) + side * np.sin(half) * across for side in (-1, 1))
        return self.directions @ left / (start @ left), self.directions @ right / (start @ right)

    def roof(self, fold_deg: float, angle_deg: float, column: float) -> Floats:
        """Inverse depth (rows, cols) of such a fold, its ridge towards the scanner."""
        return np.minimum(*self.walls(fold_deg, angle_deg, column))

    def about_ridge(self, angle_deg: float, column: float) -> tuple[Floats, Floats]:
        """How far every sample lies from such a ridge, and where along it, in samples of the picture."""
        rows, cols = self.indices
        right, up = cols - column, (self.rows - 1) / 2 - rows
        cos, sin = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
        return right * cos + up * sin, up * cos - right * sin

    def cylinder(self, radius: float, *, distance: float = DISTANCE_MM, hollow: bool = False) -> Floats:
        """Inverse depth of an upright cylinder, its nearest line (hollow: its farthest) at this distance."""
        x = self.directions[..., 0]
        axis = distance - radius if hollow else distance + radius
        # (depth·x)² + (depth − axis)² = radius²
        root = np.sqrt(axis**2 - (1 + x**2) * (axis**2 - radius**2))
        return (1 + x**2) / (axis + (root if hollow else -root))

    def book(self, slope_deg: float, reach_mm: float, column: float) -> tuple[Floats, Floats]:
        """Exact facets (rows, cols, 3) of an open book, and the place (cols,) mm on the paper that each column sees.

        The walls rise from the spine, at `column`, by slope_deg · exp(−way / reach_mm).
        """
        way = np.linspace(0.0, 120.0, 120_001)
        rise = np.deg2rad(slope_deg) * np.exp(-way / reach_mm)
        x, z = (np.concatenate([[0.0], np.cumsum(f(0.5 * (rise[1:] + rise[:-1])) * way[1])]) for f in (np.cos, np.sin))
        depth = DISTANCE_MM - np.concatenate([z[:0:-1], z])
        spine = self.directions[0, 0, 0] + column * self.rays.dx
        sights = np.concatenate([spine * DISTANCE_MM - x[:0:-1], spine * DISTANCE_MM + x]) / depth
        seen = self.directions[0, :, 0]
        along = np.interp(seen, sights, np.concatenate([-way[:0:-1], way]))
        depth = np.interp(seen, sights, depth)
        slope = np.sign(along) * np.tan(np.deg2rad(slope_deg) * np.exp(-np.abs(along) / reach_mm))
        # on the plane with normal (−slope, 0, 1) through (x, y, −1) · depth: see Sheet.normals
        across = self.rays.dx * slope / (depth * (1.0 + slope * seen))
        facets = np.stack([1.0 / depth, across, np.zeros(self.cols)], axis=-1)
        return np.broadcast_to(facets, (*self.shape, 3)).copy(), along

    def shot(self, inverse_depth: Floats, texture: Bytes | None = None) -> RangeScan:
        """A scan of inverse depth (rows, cols), NaN for none, with a texture pixel for each sample."""
        rows, cols = self.indices
        points = self.rays.points(rows, cols, inverse_depth)
        return RangeScan(points, texture, np.dstack([cols, rows]))

    def facets(self, inverse_depth: Floats) -> Floats:
        """(rows, cols, 3): with its change per column and per row, exact for planes."""
        down, right = np.gradient(inverse_depth)
        return np.dstack([inverse_depth, right, down])

    def sheet(self, planes: Floats, inside: Mask | None = None) -> Sheet:
        """A prepared sheet of these facets (rows, cols, 3), with a texture pixel for each sample."""
        rows, cols = self.indices
        inside = np.ones(self.shape, bool) if inside is None else inside
        still, pixels = np.zeros((*inside.shape, 2)), np.dstack([cols, rows])
        return Sheet(self.rays, inside, inside, planes, still, MIN_NOISE, pixels, self.shot(planes[..., 0]))


@pytest.fixture(scope="session")
def camera() -> Camera:
    return Camera()


@pytest.fixture(scope="session")
def warped() -> Callable[..., Warped]:
    return make_warped


@pytest.fixture
def plain(monkeypatch) -> Callable[[ModuleType], dict[str, Any]]:
    """Has all compiled functions that a module knows run as plain Python; they are returned by name."""

    def interpreted(module: ModuleType) -> dict[str, Any]:
        dispatcher = numba.core.dispatcher.Dispatcher
        kernels = {name: value for name, value in vars(module).items() if isinstance(value, dispatcher)}
        for name, kernel in kernels.items():
            monkeypatch.setattr(module, name, kernel.py_func)
        return kernels

    return interpreted


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(scope="module")
def random_page():
    """A flat page of 90 × 60 mm with a texture of random pixels."""
    x, y = np.meshgrid(np.linspace(0, 90, 16), np.linspace(60, 0, 11))
    vertices = np.stack([x, y, 0 * x - 700.0], axis=-1).reshape(-1, 3)
    index = np.arange(x.size).reshape(x.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    texture = np.random.default_rng(3).integers(0, 255, (120, 180, 3), np.uint8)
    texcoords = np.column_stack([2.0 * vertices[:, 0] - 0.5, 119.5 - 2.0 * vertices[:, 1]])
    return restore(SurfaceMesh(vertices, faces, texcoords, texture), Settings(dpi=50.8))

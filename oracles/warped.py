"""Warped pages whose flat truth is exact, and the comparison with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay

from restore.scan import Floats, Ints, SurfaceMesh

PAGE_MM = (280.0, 200.0)
DISTANCE_MM = 900.0
STEEPEST = np.deg2rad(110.0)  # of a curl: past upright at both ends, and short of touching itself
WALL = np.deg2rad(66.0)  # of a book's pages where they meet


class Shape(NamedTuple):
    """A cylinder over any profile.

    slope(u)  angle of the profile in radians at u mm along the page from its middle; it may jump at `breaks`.
    turn_deg  how far its rulings lean from upright.
    """

    slope: Callable[[Floats], Floats]
    turn_deg: float = 0.0
    breaks: tuple[float, ...] = ()


FLAT = Shape(np.zeros_like)
SHAPES = {
    "curl": Shape(lambda u: STEEPEST * u / (PAGE_MM[0] / 2)),
    "oblique wave": Shape(lambda u: np.deg2rad(50.0) * np.sin(2 * np.pi * u / 90.0), 35.0),
    "gutter": Shape(lambda u: np.where(u < 0, -WALL, WALL) * np.exp(-np.abs(u) / 25.0), 0.0, (0.0,)),
    "fold": Shape(lambda u: np.where(u < 17.0, np.deg2rad(-45.0), np.deg2rad(45.0)), 20.0, (17.0,)),
}


@dataclass(frozen=True, eq=False)
class Warped:
    """A warped page: mesh, its flat truth (n, 2) mm and the true lengths (e,) mm of its edges."""

    mesh: SurfaceMesh
    flat: Floats
    lengths: Floats

    def error(self, flat: Floats) -> float:
        """Largest distance in mm from the truth, moved and turned to fit but neither scaled nor mirrored."""
        found, true = flat - flat.mean(axis=0), self.flat - self.flat.mean(axis=0)
        angle = np.arctan2((found[:, 0] * true[:, 1] - found[:, 1] * true[:, 0]).sum(), (found * true).sum())
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        return float(np.linalg.norm(found @ turn - true, axis=1).max())

    def folded_over(self, far: float = 1.2) -> Floats:
        """The flat truth but for its middle vertex: moved to the opposite side of a face and, beyond 1, over it."""
        flat, middle = self.flat.copy(), int(np.argmin(np.linalg.norm(self.flat, axis=1)))
        face = next(f for f in self.mesh.faces if middle in f)
        flat[middle] += far * (flat[face[face != middle]].mean(axis=0) - flat[middle])
        return flat

    def mirrored_at(self, corner: int) -> Floats:
        """The flat truth but for a vertex of one face: mirrored at the opposite side, with its lengths as they were."""
        flat, face = self.flat.copy(), next(f for f in self.mesh.faces if corner in f)
        start, end = flat[face[face != corner]]
        along, offset = (end - start) / np.linalg.norm(end - start), flat[corner] - start
        flat[corner] = start + 2 * (offset @ along) * along - offset
        return flat


def scattered(count: int, seed: int, size: tuple[float, float] = PAGE_MM) -> tuple[Floats, Ints]:
    """About `count` irregular points on a page, (n, 2) mm from its middle, joined counter-clockwise."""
    step = np.sqrt(size[0] * size[1] / count)
    across, along = (side * np.linspace(-0.5, 0.5, round(side / step) + 1) for side in size)
    points = np.stack(np.meshgrid(across, along), axis=-1)
    points[1:-1, 1:-1] += np.random.default_rng(seed).uniform(-0.3, 0.3, points[1:-1, 1:-1].shape) * step
    points = points.reshape(-1, 2)
    faces = Delaunay(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, k]] for k in range(3))
    areas = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces = np.where((areas > 0)[:, None], faces, faces[:, ::-1])
    return points, faces[np.abs(areas) > 1e-6 * step**2]  # on straight borders it leaves slivers


def bend(flat: Floats, shape: Shape, sign: float = 1.0) -> Floats:
    """The page (n, 2) mm bent to a shape, (n, 3) mm before the scanner: towards it (sign 1) or away from it (−1)."""
    angle = np.deg2rad(shape.turn_deg)
    cos, sin = np.cos(angle), np.sin(angle)
    u, v = flat @ [cos, sin], flat @ [-sin, cos]
    knots = np.unique(np.concatenate([u, shape.breaks, [u.min() - 1e-9]]))
    # Gauss' rule of eight points is exact to 1e-12 mm between neighbouring points.
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = np.diff(knots) / 2
    slope = sign * shape.slope((knots[1:] + knots[:-1])[:, None] / 2 + half[:, None] * nodes)
    x, z = (np.append(0.0, np.cumsum(half * (part @ weights))) for part in (np.cos(slope), np.sin(slope)))
    x, z = (np.interp(u, knots, part - np.interp(0.0, knots, part)) for part in (x, z))
    return np.stack([x * cos - v * sin, x * sin + v * cos, z - DISTANCE_MM], axis=1)


def edges(faces: Ints) -> Ints:
    """(e, 2) every edge once, in ascending order."""
    return np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)


def make_warped(
    shape: str | None = None,
    sign: float = 1.0,
    *,
    count: int = 1000,
    seed: int = 0,
    size: tuple[float, float] = PAGE_MM,
) -> Warped:
    """A page of one of the SHAPES, or flat; its texture has ten pixels to the millimetre."""
    flat, faces = scattered(count, seed, size)
    vertices = bend(flat, FLAT if shape is None else SHAPES[shape], sign)
    texcoords = 10.0 * (flat * [1, -1] + [size[0] / 2, size[1] / 2])
    ends = edges(faces)
    lengths = np.linalg.norm(flat[ends[:, 0]] - flat[ends[:, 1]], axis=1)
    return Warped(SurfaceMesh(vertices, faces, texcoords), flat, lengths)

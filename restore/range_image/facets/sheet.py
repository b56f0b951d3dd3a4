"""The prepared sheet: a surface with points and lengths at any position on the grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, map_coordinates

from restore.camera.rays import MAX_SLOPE, LensTerms, Rays, distortion_factor
from restore.mesh.raster import rasterise
from restore.mesh.topology import Topology
from restore.numerics.limits import TINY
from restore.range_image.facets.facet_model import WIDE_RADIUS, Facets, in_whole_windows
from restore.range_image.facets.slope_statistics import slope_variances, unbiased
from restore.report import DistanceReport
from restore.runtime.threads import in_bands
from restore.scan import Floats, Ints, Mask, RangeScan

# Slopes that differ by more than this many times the noise are two sides of a crease, not noise of one facet.
CREASE_SIGMAS = 1.0
OWN_SIDE = 0.3  # of the turn at a crease, at most, that one of its sides makes in the step before
ROUNDS = 3  # of Newton's method: where two parabolas meet
WIDEST_STRIDE = 4  # samples from node to node of the lattices by which sheets are solved

_distortion_factor = numba.njit(cache=True, inline="always")(distortion_factor)


@dataclass(frozen=True, eq=False)
class Sheet:
    """Facets on the grid of rays, extrapolated past the outline.

    Border samples have neighbours that way.
    inside: (rows, cols), True on the sheet, interior holes included.
    measured: (rows, cols), True where the surface was measured and not filled in.
    planes: (rows, cols, 3), inverse depth and its change per column and per row.
    scatter: (rows, cols, 2), variance of the change per column and of that per row, (1/mm)².
    noise: standard deviation of one measured sample, 1/mm.
    pixels: (rows, cols, 2), texture position of every grid position.
    scan: the source of the surface, with its texture and provenance.
    cut_out: whether it ends where a mesh was cut: on the page, and not before samples of what lies beyond.
    lost_border: fraction of its border along which paper may have given no range: see `lost_border`.
    cut: fraction of its border in the first and last rows and columns of the image.
    turned_border: fraction of its border that is turned away from the scanner: see `turned_border`.
    holes: (rows, cols), True where it has a hole through which the table was measured; None where it was not checked.
    """

    rays: Rays
    inside: Mask
    measured: Mask
    planes: Floats
    scatter: Floats
    noise: float
    pixels: Floats
    scan: RangeScan
    cut_out: bool = False
    lost_border: float = 0.0
    cut: float = 0.0
    turned_border: float = 0.0
    holes: Mask | None = None

    def inverse_depth(self, nodes: Floats) -> Floats:
        """Return inverse depth (n,) 1/mm at grid positions.

        nodes: (n, 2) (row, col), fractions allowed.
        """
        return _evaluate(self.planes, nodes)

    def points(self, nodes: Floats) -> Floats:
        """Return the points (n, 3) mm at grid positions.

        nodes: (n, 2) (row, col), fractions allowed.
        """
        return self.rays.points(nodes[:, 0], nodes[:, 1], self.inverse_depth(nodes))

    def normals(self) -> NDArray[np.float32]:
        """Return the unit normals of the facets, towards the camera.

        On a plane n · P = c, seen along P = (x, y, −1)·depth, inverse depth is (n_x·x + n_y·y − n_z) / c. Returns
        (rows, cols, 3).
        """
        normals = np.empty(self.planes.shape, np.float32)

        def set_normals(rows: slice) -> None:
            rays = self.rays
            _set_normals(self.planes, rays.x0, rays.dx, rays.y0, rays.dy, rows.start, rows.stop, normals)

        in_bands(set_normals, len(normals))
        return np.asarray(normals @ self.rays.axes.astype(np.float32))

    def texcoords(self, nodes: Floats) -> Floats:
        """Return the texture pixels (n, 2) at grid positions.

        nodes: (n, 2) (row, col), fractions allowed.
        """
        return np.stack(
            [map_coordinates(self.pixels[..., k], nodes.T, order=1, mode="nearest") for k in (0, 1)], axis=1
        )

    def lengths(self, nodes: Floats, edges: Ints) -> Floats:
        """Return the lengths of edges along the surface.

        The path is straight in the image; on each sample it runs in that sample's facet, and where two facets meet at
        an angle it runs over the line in which their sides would meet if they continued to turn, not along the chord.
        It is shortened by the mean excess that the scatter of the slopes causes.
        nodes: (n, 2), grid positions.
        edges: (e, 2).
        Returns (e,) mm.
        """
        lengths, lens, tolerance = np.empty(len(edges)), self.rays.lens, CREASE_SIGMAS * self.noise

        def measure(part: slice) -> None:
            _path_lengths(self.planes, self.scatter, nodes, edges[part], lens, tolerance, lengths[part])

        in_bands(measure, len(edges))
        return lengths


@dataclass(frozen=True, eq=False)
class PageOnGrid:
    """Flat page as a mesh over the grid.

    flat: (n, 2) mm.
    faces: (m, 3).
    nodes: (n, 2), grid positions.
    """

    flat: Floats
    faces: Ints
    nodes: Floats

    @cached_property
    def topology(self) -> Topology:
        """Which faces meet in which edges."""
        return Topology(self.faces)


def make_sheet(
    rays: Rays,
    facets: Facets,
    samples: Mask,
    inside: Mask,
    pixels: Floats,
    scan: RangeScan,
    radius: int = WIDE_RADIUS,
) -> Sheet:
    """Return a sheet from its facets, extrapolated over the grid.

    The rest of the grid takes the nearest facet. A facet steeper than camera and laser can see is dropped: the few
    samples on a steep wall determine its slope badly.
    samples, inside, pixels: (rows, cols), (rows, cols) and (rows, cols, 2), as in Sheet.
    radius: samples, of the wide window of the facets.
    """
    steepest = MAX_SLOPE * abs(rays.dx) * facets.value
    known = inside & (np.hypot(*np.moveaxis(facets.slope, -1, 0)) < steepest)  # NaN is not
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    sound = in_whole_windows(known & ~facets.crease, radius)
    slopes = unbiased(facets.slope, sound, radius)
    planes = np.dstack([facets.value, slopes])
    beyond = np.nonzero(~known)
    rows, cols = nearest[:, *beyond]
    value, across, down = planes[rows, cols].T
    value = value + across * (beyond[1] - cols) + down * (beyond[0] - rows)
    planes[beyond] = np.stack([value, across, down], axis=1)
    return Sheet(rays, inside, samples, planes, slope_variances(slopes, sound, radius), facets.noise, pixels, scan)


def depth_distance(sheet: Sheet, nodes: Floats, faces: Ints) -> DistanceReport:
    """Return mean, sd and max of the depth between sheet and mesh, mm.

    nodes: (n, 2), grid positions.
    faces: (m, 3).
    """
    corners = np.ascontiguousarray(nodes[:, ::-1])
    # A plane's inverse depth is affine over the grid, so linear interpolation over the triangles is exact.
    sparse = rasterise(corners, faces, sheet.inverse_depth(nodes)[:, None], *sheet.inside.shape)[..., 0]
    both = sheet.inside & np.isfinite(sparse)
    distance = np.abs(1.0 / sparse[both] - 1.0 / sheet.planes[both][:, 0])
    return {"mean_mm": float(distance.mean()), "sd_mm": float(distance.std()), "max_mm": float(distance.max())}


@numba.njit(cache=True, nogil=True)
def _set_normals(
    planes: Floats, x0: float, dx: float, y0: float, dy: float, first: int, end: int, normals: NDArray[np.float32]
) -> None:
    """Write the normals of the rows from first to end."""
    for row in range(first, end):
        for col in range(planes.shape[1]):
            across, along = planes[row, col, 1] / dx, planes[row, col, 2] / dy
            back = across * (x0 + dx * col) + along * (y0 + dy * row) - planes[row, col, 0]
            # c is negative for a normal that points back to the lens
            scale = -1.0 / np.sqrt(across * across + along * along + back * back)
            normals[row, col, 0] = across * scale
            normals[row, col, 1] = along * scale
            normals[row, col, 2] = back * scale


@numba.njit(cache=True, inline="always")
def _nearest(position: float, count: int) -> int:
    return min(max(int(np.floor(position + 0.5)), 0), count - 1)


def _evaluate(planes: Floats, nodes: Floats) -> Floats:
    row, col = nodes.T
    i, j = (
        np.clip(np.floor(places + 0.5), 0, count - 1).astype(np.int64)
        for places, count in ((row, planes.shape[0]), (col, planes.shape[1]))
    )
    value, across, down = planes[i, j].T
    return np.asarray(value + across * (col - j) + down * (row - i))


@numba.njit(cache=True, inline="always")
def _turn_before(planes: Floats, r: float, c: float, dr: float, dc: float, slope: float, beyond: float) -> float:
    """Return how far a side turns before a crease, from (r, c) to its last sample.

    0 where that is too much of the turn at the crease: then another crease is there, or none at all.
    slope: at its end.
    """
    i, j = _nearest(r, planes.shape[0]), _nearest(c, planes.shape[1])
    turn = slope - planes[i, j, 1] * dc - planes[i, j, 2] * dr
    return turn if abs(turn) < OWN_SIDE * abs(slope - beyond) else 0.0


@numba.njit(cache=True, inline="always")
def _along(w: float, slope: float, turn: float, t: float) -> float:
    """Inverse depth t steps from a sample, on a side that goes on turning."""
    return w + (slope + 0.5 * turn * t) * t


@numba.njit(cache=True, inline="always")
def _crossing(wa: float, sa: float, turn_a: float, wb: float, sb: float, turn_b: float) -> float:
    """Return the fraction of a step at which two sides meet.

    By Newton's method; its ends if they do not meet.
    """
    t = (wb - sb - wa) / (sa - sb)
    for _ in range(ROUNDS):
        t = min(max(t, 0.0), 1.0)
        apart = _along(wa, sa, turn_a, t) - _along(wb, -sb, turn_b, 1.0 - t)
        t -= apart / (sa + turn_a * t - sb + turn_b * (1.0 - t))
    return min(max(t, 0.0), 1.0)


@numba.njit(cache=True, inline="always")
def _unproject(r: float, c: float, w: float, lens: LensTerms) -> tuple[float, float, float]:
    x0, dx, y0, dy, k1, k2 = lens
    u, v = x0 + dx * c, y0 + dy * r
    depth = 1.0 / w
    scale = depth / _distortion_factor(u * u + v * v, k1, k2)
    return u * scale, v * scale, depth


@numba.njit(cache=True, inline="always")
def _distance(ra: float, ca: float, wa: float, rb: float, cb: float, wb: float, lens: LensTerms) -> float:
    xa, ya, za = _unproject(ra, ca, wa, lens)
    xb, yb, zb = _unproject(rb, cb, wb, lens)
    return np.sqrt((xa - xb) ** 2 + (ya - yb) ** 2 + (za - zb) ** 2)


@numba.njit(cache=True, nogil=True)
def _path_lengths(
    planes: Floats, scatter: Floats, nodes: Floats, edges: Ints, lens: LensTerms, tolerance: float, lengths: Floats
) -> None:
    """Write the lengths (e,) of edges (e, 2)."""
    rows, cols, _ = planes.shape
    for e in range(len(edges)):
        r0, c0 = nodes[edges[e, 0], 0], nodes[edges[e, 0], 1]
        r1, c1 = nodes[edges[e, 1], 0], nodes[edges[e, 1], 1]
        steps = max(1, int(np.ceil(max(abs(r1 - r0), abs(c1 - c0)))))
        dr, dc, length = (r1 - r0) / steps, (c1 - c0) / steps, 0.0
        for k in range(steps):
            ra, ca = r0 + k * dr, c0 + k * dc
            rb, cb = ra + dr, ca + dc
            i, j = _nearest(ra, rows), _nearest(ca, cols)
            m, n = _nearest(rb, rows), _nearest(cb, cols)
            wa = planes[i, j, 0] + planes[i, j, 1] * (ca - j) + planes[i, j, 2] * (ra - i)
            wb = planes[m, n, 0] + planes[m, n, 1] * (cb - n) + planes[m, n, 2] * (rb - m)
            sa = planes[i, j, 1] * dc + planes[i, j, 2] * dr
            sb = planes[m, n, 1] * dc + planes[m, n, 2] * dr
            t, turn_a, turn_b = 0.5, 0.0, 0.0
            if abs(sa - sb) > tolerance:
                turn_a = _turn_before(planes, ra - dr, ca - dc, dr, dc, sa, sb)
                turn_b = _turn_before(planes, rb + dr, cb + dc, -dr, -dc, -sb, -sa)
                t = _crossing(wa, sa, turn_a, wb, sb, turn_b)
            rm, cm = ra + t * dr, ca + t * dc
            way = _distance(ra, ca, wa, rm, cm, _along(wa, sa, turn_a, t), lens)
            way += _distance(rm, cm, _along(wb, -sb, turn_b, 1.0 - t), rb, cb, wb, lens)
            # A depth that scatters by ε makes the way √(across² + (deep + ε)²) longer by ε² · across² / (2 · way³).
            across2 = max(way * way - (1.0 / wb - 1.0 / wa) ** 2, 0.0)
            epsilon2 = (dc * dc * scatter[i, j, 0] + dr * dr * scatter[i, j, 1]) / (wa * wb) ** 2
            length += way - 0.5 * epsilon2 * across2 / (way * way * way + TINY)
        lengths[e] = length

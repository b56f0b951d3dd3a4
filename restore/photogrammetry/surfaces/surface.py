"""Sheet of paper through points: a bicubic spline to space.

Position is a function of u and v, millimetres on the flat page, so that a side that stands upright is not steeper than
any other. The coefficients minimise the squared distances of the points along the normal, the change of curvature, and
the strain: paper does not stretch, so where no point is near, the sheet prolongs the rulings that end there. It is
solved by Gauss–Newton; the points' feet on the sheet follow from step to step. Points far off have Huber's weights:
with weights that vanish, a corner that the sheet does not reach at once would be given up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from restore.numerics.limits import TINY
from restore.numerics.robust import CAUCHY, MAJORITY, robust_sigma
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.errors import SheetLost
from restore.photogrammetry.surfaces.lattice import Cloud
from restore.photogrammetry.surfaces.spline import (
    BORDER,
    add_bending,
    add_points,
    add_strain,
    evaluate,
    numbering,
    solve,
)
from restore.report import SurfaceReport
from restore.scan import Floats, Ints, Mask

STEP_MM = 8.0  # of the knots: a wave of 90 mm and 38° lies within 5 µm of such a spline
MAX_STEPS = 10  # of Gauss–Newton
REACH_MM = 4.0  # by which a surface may be off at first
REFINING_MM = 0.1  # between two stiffnesses
SETTLED_MM = 1e-3  # largest move at a point
COMPARED_MM = 0.01  # the same between two stiffnesses: errors of 0.02 mm at most points differ by less than GAIN
FEET_STEPS = 3
STRAIN_STIFFNESS = 8e3  # mm² for a cell of STEP_MM: strain of 2e-4 costs as much as a point that is 0.02 mm off
MAX_STRAIN = 0.01  # of paper that may have creases
SLIDING = 1e-3  # weight of a point along the sheet, against that along the normal: feet are free to slide
STIFFNESSES = tuple(10.0**exponent for exponent in (5, 4, 3, 2, 1))  # mm⁴: tried, the stiffest first
HELD_OUT = 0.1  # of the points determine which stiffness is best
GAIN = 0.99  # of the error that a softer surface must leave at most, to be preferred
MIN_SIGMA_MM = 0.002  # of points: exact ones would all be outliers but a few
SAMPLE_MM = 4.0  # of the places at which a sheet is resampled
SEED = 5  # of what is held out


@dataclass(frozen=True, eq=False)
class Surface:
    """Points in space over u and v.

    coefficients: (rows, cols, 3), of cubic B-splines, from a knot low (2,) on.
    """

    piece_count: ClassVar[int] = 1
    low: Floats
    step: float
    coefficients: Floats

    @classmethod
    def level(cls, low: Floats, high: Floats, height: float) -> Surface:
        """Return the plane u, v = x, y at a height, mm, over a rectangle low (2,) to high (2,)."""
        cols, rows = (np.ceil((np.asarray(high) - low) / STEP_MM).astype(int) + 1 + 2 * BORDER).tolist()
        first = np.asarray(low, float) - BORDER * STEP_MM
        x, y = np.meshgrid(first[0] + STEP_MM * np.arange(cols), first[1] + STEP_MM * np.arange(rows))
        return cls(first, STEP_MM, np.stack([x, y, np.full_like(x, height)], axis=-1))

    @property
    def bounds(self) -> tuple[Floats, Floats]:
        """Return the rectangle in u and v with all knots, mm, from low (2,) to high (2,)."""
        size = np.array(self.coefficients.shape[1::-1]) - 1 - 2 * BORDER
        low = self.low + BORDER * self.step
        return low, low + size * self.step

    @property
    def smooth(self) -> Surface:
        """The surface itself: it has no creases."""
        return self

    def uncreased(self, places: Floats, half: float) -> Mask:  # noqa: ARG002 (as of a surface with creases)
        """Return (n,) True: no square about places (n, 2) mm holds a crease."""
        return np.ones(len(places), bool)

    def flat_corners(self, vertices: Floats, faces: Ints, places: Floats) -> Floats:  # noqa: ARG002 (as of a folded one)
        """Return the corners (m, 3, 2) mm of faces (m, 3) on the flat page."""
        return places[faces]

    def creased(self, places: Floats, faces: Ints) -> Floats:  # noqa: ARG002 (as of a folded one)
        """Return mesh vertices (n, 3) mm at places (n, 2) mm."""
        return self.points(places)

    def gutter_widths(self) -> None:
        """Return None: no crease parts it in two."""

    def described(self, stiffness: float) -> SurfaceReport:
        """Return what a report says of it."""
        return {"shape": "smooth", "stiffness_mm4": stiffness, "smooth_pieces": 1}

    def edge_counts(self, places: Floats, measured: Mask, spacing: float) -> Ints:  # noqa: ARG002 (as of a folded one)
        """Return how often points of an edge count, (n,): once where they are measured."""
        return measured.astype(np.int64)

    def through(self, cloud: Cloud, stiffness: float) -> Surface:
        """Return the surface of a stiffness in mm⁴ through points near it."""
        return fit_surface(cloud.points, cloud.feet, self, stiffness=stiffness)[0]

    def points(self, places: Floats) -> Floats:
        """Return points (n, 3) mm on the surface at places (n, 2) mm."""
        return evaluate(np.ascontiguousarray(places, np.float64), self.low, self.step, self.coefficients, 0)[:, 0]

    def derivatives(self, places: Floats) -> Floats:
        """Return positions and derivatives (n, 6, 3) by u, v, uu, uv, vv at places (n, 2) mm."""
        return evaluate(np.ascontiguousarray(places, np.float64), self.low, self.step, self.coefficients, 2)

    def normals(self, places: Floats) -> Floats:
        """Return unit normals (n, 3) at places (n, 2) mm."""
        by = self.derivatives(places)
        normals = np.cross(by[:, 1], by[:, 2])
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))

    def frames(self, places: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return points, tangents, normals and curvatures at places (n, 2) mm.

        They are (n, 3) mm, (n, 2, 3), (n, 3) and (n, 3) 1/mm. The curvatures are those along the first tangent, mixed
        and along the second: about a point the surface is p + a t1 + b t2 + (k11 a² + 2 k12 a b + k22 b²)/2 n.
        """
        point, su, sv, suu, suv, svv = np.moveaxis(self.derivatives(places), 1, 0)
        normals = np.cross(su, sv)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        first = su / np.linalg.norm(su, axis=1, keepdims=True)
        second = np.cross(normals, first)
        # By u and v, the tangents are the columns of the inverse of the map from du, dv to the lengths along them.
        to_frame = np.stack([[(su * first).sum(1), (sv * first).sum(1)], [(su * second).sum(1), (sv * second).sum(1)]])
        turn = np.linalg.inv(np.moveaxis(to_frame, -1, 0))
        bend = np.stack([[(suu * normals).sum(1), (suv * normals).sum(1)]] * 2)
        bend[1] = (suv * normals).sum(1), (svv * normals).sum(1)
        form = np.einsum("nki,kln,nlj->nij", turn, bend, turn)
        curvatures = np.stack([form[:, 0, 0], form[:, 0, 1], form[:, 1, 1]], axis=1)
        return point, np.stack([first, second], axis=1), normals, curvatures

    def feet(self, points: Floats, start: Floats) -> Floats:
        """Return places (n, 2) mm next to points (n, 3) mm, by Gauss–Newton.

        start: (n, 2), places to search from.
        """
        places = np.array(start, float)
        for _ in range(FEET_STEPS):
            by = self.derivatives(places)
            off, su, sv = points - by[:, 0], by[:, 1], by[:, 2]
            a, b, c = (su * su).sum(1), (su * sv).sum(1), (sv * sv).sum(1)
            p, q = (off * su).sum(1), (off * sv).sum(1)
            move = np.stack([c * p - b * q, a * q - b * p], axis=1) / (a * c - b * b)[:, None]
            places += np.clip(move, -2 * STEP_MM, 2 * STEP_MM)
        return places

    def nearest(self, points: Floats) -> Floats:
        """Return places (n, 2) mm next to points (n, 3) mm, wherever they are."""
        lattice = grid_places(*self.bounds, SAMPLE_MM)
        _, index = cKDTree(self.points(lattice)).query(points)
        return self.feet(points, lattice[index])

    def within(self, low: Floats, high: Floats) -> Surface:
        """Return the surface over a rectangle low (2,) to high (2,), prolonged without bending."""
        here = self.bounds
        places = grid_places(np.maximum(low, here[0]), np.minimum(high, here[1]), SAMPLE_MM)
        return through_places(places, self.points(places), low, high)

    def moved(self, similarity: Similarity) -> Surface:
        """The surface in another frame; u and v stay as they are."""
        flat = similarity.points(self.coefficients.reshape(-1, 3))
        return replace(self, coefficients=flat.reshape(self.coefficients.shape))


def grid_places(low: Floats, high: Floats, step: float) -> Floats:
    """Return places (n, 2) on a square lattice from low (2,) to high (2,)."""
    axes = [np.arange(start, end + step / 2, step) for start, end in zip(low, high, strict=True)]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)


def through_places(places: Floats, points: Floats, low: Floats, high: Floats) -> Surface:
    """Fit a surface to points at places of the flat page over a rectangle low to high (2,).

    places: (n, 2) mm.
    points: (n, 3) mm.
    """
    level = Surface.level(low, high, 0.0)
    # Beyond the places it stays near where it begins: in the plane of the points, however the places are turned.
    turned = np.linalg.lstsq(_affine(places), points, rcond=None)[0]
    surface = replace(level, coefficients=_affine(level.coefficients[..., :2]) @ turned)
    equations = _Equations(surface)
    equations.add_points(points, places, np.zeros_like(points), np.ones(len(points)), 1.0)
    equations.add_bending(1e-3)
    return equations.solved()


def _affine(places: Floats) -> Floats:
    """Places (…, 2) with a third coordinate of one."""
    return np.concatenate([places, np.ones_like(places[..., :1])], axis=-1)


@dataclass(frozen=True)
class Paper:
    """How a sheet resists.

    stiffness: against changes of its curvature, mm⁴.
    along: times as much against those that a sheet ruled along v does not have; above 1, changes across the rulings
        continue evenly.
    most_strain: at which a cell resists half as much: a crease that is rounded would strain the paper next to it.
    """

    stiffness: float
    along: float = 1.0
    most_strain: float = MAX_STRAIN


def fit_surface(
    points: Floats,
    feet: Floats,
    start: Surface,
    *,
    stiffness: float,
    inextensible: bool = True,
    settled: float = SETTLED_MM,
) -> tuple[Surface, Floats]:
    """Fit a surface of a stiffness in mm⁴ through points.

    Surface and feet begin near the solution.
    points: (n, 3) mm.
    feet: (n, 2) mm.
    inextensible: whether it resists strain. Before u and v are known, it has to stretch, and the feet stay where they
        are: on a sheet that stretches freely they would run away from step to step.
    settled: the largest move at a point, mm, at which it ends.
    Returns the surface and the feet.
    """
    return fit_paper(points, feet, start, Paper(stiffness), inextensible=inextensible, settled=settled)


def fit_paper(
    points: Floats,
    feet: Floats,
    start: Surface,
    paper: Paper,
    *,
    inextensible: bool = True,
    reach: float = REACH_MM,
    settled: float = SETTLED_MM,
) -> tuple[Surface, Floats]:
    """Fit a surface of some paper through points.

    Surface and feet begin near the solution. Points that the surface does not follow yet are not outliers: none is less
    likely than one as far off as the surface moved in the last step.
    points: (n, 3) mm.
    feet: (n, 2) mm.
    reach: by how much the start may be off, mm.
    settled: the largest move at a point, mm, at which it ends.
    Returns the surface and the feet. Raises SheetLost.
    """
    surface, moving = start, reach
    distance = _distances(surface, points, feet)
    for _ in range(MAX_STEPS):
        sigma = max(robust_sigma(distance), moving, MIN_SIGMA_MM)
        weights = np.minimum(1.0, CAUCHY * sigma / np.maximum(np.abs(distance), TINY))
        equations = _Equations(surface, ruled=paper.along > 1.0)
        equations.add_points(points, feet, surface.normals(feet), weights, SLIDING if inextensible else 1.0)
        equations.add_bending(paper.stiffness / surface.step**4, paper.along)
        if inextensible:
            equations.add_strain(paper.most_strain)
        surface = equations.solved()
        if inextensible:
            feet = surface.feet(points, feet)
            _check_on_sheet(surface, feet)
        before, distance = distance, _distances(surface, points, feet)
        moving = min(moving, float(np.abs(distance - before).max()))
        if moving < settled:
            break
    return surface, feet


def _check_on_sheet(surface: Surface, feet: Floats) -> None:
    """Raise SheetLost where most feet are beyond all knots of a surface.

    Or any is without end. Some of the points may be: what is prolonged ends anywhere.
    feet: (n, 2) mm.
    """
    low, high = surface.bounds
    beyond = BORDER * surface.step
    on_sheet = ((feet >= low - beyond) & (feet <= high + beyond)).all(axis=1)
    if on_sheet.mean() < MAJORITY or not np.isfinite(feet).all():
        raise _sheet_lost()


def _sheet_lost() -> SheetLost:
    return SheetLost(
        "no sheet of paper goes through the points that the photographs show",
        "do not move the page between the photographs, and photograph it from more sides",
    )


def _distances(surface: Surface, points: Floats, feet: Floats) -> Floats:
    """Return distances (n,) mm of points along the normals at their feet.

    points: (n, 3).
    feet: (n, 2).
    """
    return np.asarray(((points - surface.points(feet)) * surface.normals(feet)).sum(axis=1))


def choose_stiffness(points: Floats, feet: Floats, start: Surface) -> float:
    """Choose the stiffness, mm⁴, by points held out.

    A surface through most of the points (n, 3) mm comes nearest to the others with it.
    """
    return choose_paper([(points, feet, start)], [Paper(stiffness) for stiffness in STIFFNESSES]).stiffness


def choose_paper(parts: Sequence[tuple[Floats, Floats, Surface]], papers: Sequence[Paper]) -> Paper:
    """Choose the first of the best papers, by points held out.

    Surfaces through most of the points come nearest to the others with it. A paper with which the sheet is lost is not
    considered.
    parts: each has points (n, 3) mm, their feet (n, 2) mm and a surface to start from.
    """
    rng = np.random.default_rng(SEED)
    split = [(part, rng.random(len(part[0])) < HELD_OUT) for part in parts]
    split = [(part, held) for part, held in split if held.any() and not held.all()]
    surfaces, used = [start for (_, _, start), _ in split], [feet[~held] for (_, feet, _), held in split]
    others = [feet[held] for (_, feet, _), held in split]
    best, least = papers[0], np.inf
    for paper in papers if split else ():
        errors = []
        try:
            for k, ((points, _, _), held) in enumerate(split):
                surfaces[k], used[k] = fit_paper(
                    points[~held], used[k], surfaces[k], paper, reach=REFINING_MM, settled=COMPARED_MM
                )
                others[k] = surfaces[k].feet(points[held], others[k])
                errors.append(np.abs(_distances(surfaces[k], points[held], others[k])))
        except SheetLost:
            continue
        error = float(np.concatenate(errors).mean())
        if error < GAIN * least:
            best, least = paper, error
    return best


class _Equations:
    """The normal equations of a step of a surface's coefficients."""

    def __init__(self, surface: Surface, *, ruled: bool = False) -> None:
        rows, cols, _ = surface.coefficients.shape
        by_row, by_col, width = numbering(rows, cols, along_rows=ruled)
        self._surface, self._strides = surface, (by_row, by_col)
        self._band, self._side = np.zeros((3 * rows * cols, width)), np.zeros(3 * rows * cols)

    def add_points(self, points: Floats, places: Floats, normals: Floats, weights: Floats, sliding: float) -> None:
        """Points (n, 3) mm at places (n, 2), with weights (n,) along normals (n, 3)."""
        spline = self._surface.low, self._surface.step, self._surface.coefficients
        add_points(self._band, self._side, places, points, normals, weights, sliding, *spline, *self._strides)

    def add_bending(self, weight: float, along: float = 1.0) -> None:
        """Add resistance to bending to the equations.

        `along` times as much to what a sheet ruled along v does not have.
        """
        add_bending(self._band, self._side, self._surface.coefficients, weight, along, *self._strides)

    def add_strain(self, most: float) -> None:
        """Resistance to strain; a cell resists half as much at a strain of `most`."""
        surface = self._surface
        sheet = surface.coefficients, surface.step, STRAIN_STIFFNESS, most
        add_strain(self._band, self._side, *sheet, *self._strides)

    def solved(self) -> Surface:
        """Return the surface after the step.

        Raises SheetLost where it is torn so far that the equations overflow.
        """
        try:
            solve(self._band, self._side)
        except ZeroDivisionError as error:
            raise _sheet_lost() from error
        (by_row, by_col), (rows, cols, _) = self._strides, self._surface.coefficients.shape
        at = np.arange(rows)[:, None] * by_row + np.arange(cols) * by_col
        return replace(self._surface, coefficients=self._surface.coefficients + self._side.reshape(-1, 3)[at])

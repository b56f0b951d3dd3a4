"""Random developable sheets whose flat truth is exact: ruled, folded, curve-creased, Miura and vertex folds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.sheets import Crumpled, Miura
from restore.scan import Floats

PAGE_MM = (280.0, 200.0)
REACH_MM = float(np.hypot(*PAGE_MM)) / 2  # half the diagonal: no ruling may meet another nearer than this
STRIP_MM = 0.4  # between rulings: at a radius of 60 mm the strips stay within 0.4 µm of the smooth surface
MAX_TURN_DEG = 230.0  # between the steepest two slopes of a sheet
CROSSING = 0.6  # of the change of lean at which neighbouring rulings would meet at the border of the page
CURVED_DEG = (2.5, 40.0)  # between the sheet and the plane that it is mirrored at: a curved crease of twice that
FOLD_DEG = (5.0, 80.0)
MAX_FOLDS = 5

Warp = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Ruled:
    """A sheet of flat strips between straight rulings that do not meet on the page.

    offsets (k,) mm where rulings cross the line y = 0, ascending; leans (k,) rad from the y axis; turns (k,) rad of the
    sheet at each; angle rad of the whole pattern on the page.
    """

    offsets: Floats
    leans: Floats
    turns: Floats
    angle: float

    def __call__(self, paper: Floats) -> Floats:
        """(n, 3) mm: where points (n, 2) mm of the flat page lie in space."""
        cos, sin = np.cos(self.angle), np.sin(self.angle)
        own = paper @ np.array([[cos, -sin], [sin, cos]])
        rotations, shifts = self._motions()
        strip = self._strip(own)
        return np.einsum("nij,nj->ni", rotations[strip][:, :, :2], own) + shifts[strip]

    def _strip(self, own: Floats) -> np.ndarray:
        """(n,) how many rulings lie to the left of each point, by bisection: they do not cross."""
        low, high = np.zeros(len(own), int), np.full(len(own), len(self.offsets))
        while (low < high).any():
            middle = np.minimum((low + high) // 2, len(self.offsets) - 1)
            lean = self.leans[middle]
            right = (own[:, 0] - self.offsets[middle]) * np.cos(lean) - own[:, 1] * np.sin(lean) > 0
            open_ = low < high
            low, high = np.where(open_ & right, middle + 1, low), np.where(open_ & ~right, middle, high)
        return low

    def _motions(self) -> tuple[Floats, Floats]:
        """Rotations (k + 1, 3, 3) and shifts (k + 1, 3) mm of the strips."""
        axes = np.stack([np.sin(self.leans), np.cos(self.leans), np.zeros(len(self.leans))], axis=1)
        turns = Rotation.from_rotvec(-self.turns[:, None] * axes).as_matrix()
        points = np.stack([self.offsets, np.zeros(len(self.offsets)), np.zeros(len(self.offsets))], axis=1)
        rotation, shift = np.eye(3), np.zeros(3)
        rotations, shifts = [rotation], [shift]
        for turn, point in zip(turns, points, strict=True):
            shift = rotation @ (point - turn @ point) + shift
            rotation = rotation @ turn
            rotations.append(rotation)
            shifts.append(shift)
        return np.array(rotations), np.array(shifts)


@dataclass(frozen=True, eq=False)
class Mirrored:
    """A sheet of which what lies beyond a plane (n, d) is mirrored there: a curved crease where the sheet is bent."""

    sheet: Warp
    plane: Floats

    def __call__(self, paper: Floats) -> Floats:
        """(n, 3) mm: where points (n, 2) mm of the flat page lie in space."""
        space = self.sheet(paper)
        beyond = np.maximum(space @ self.plane[:3] - self.plane[3], 0)
        return np.asarray(space - 2 * beyond[:, None] * self.plane[:3])


def _ruled(rng: np.random.Generator, spacing_mm: float, *, bent: bool, folds: int) -> Ruled:
    """A random ruled sheet; two of its folds lie within two spacings when there are more than one."""
    offsets = np.arange(-REACH_MM * 1.3, REACH_MM * 1.3, STRIP_MM)
    leans = RULINGS[str(rng.choice(list(RULINGS)))](offsets, rng)
    turns = STRIP_MM * _curvature(offsets, rng) if bent else np.zeros(len(offsets))
    if folds:
        places = rng.uniform(-0.35, 0.35, folds) * PAGE_MM[0]
        if folds > 1 and rng.random() < 0.5:
            places[1] = places[0] + rng.uniform(0.5, 2.0) * spacing_mm
        for place in places:
            nearest = int(np.argmin(np.abs(offsets - place)))
            turns[nearest] += np.radians(rng.uniform(*FOLD_DEG)) * rng.choice([-1, 1])
    slope = np.cumsum(turns)
    turns *= min(1.0, np.radians(MAX_TURN_DEG) / max(np.ptp(slope), 1e-9))
    return Ruled(offsets, leans, turns, float(rng.uniform(-np.pi, np.pi)))


def _curvature(offsets: Floats, rng: np.random.Generator) -> Floats:
    """(k,) 1/mm: an even roll, a wave, or both."""
    span = PAGE_MM[0]
    roll = np.radians(rng.uniform(20, MAX_TURN_DEG)) / span * rng.choice([-1, 1])
    slope, wave_mm = np.radians(rng.uniform(5, 50)), rng.uniform(70, 300)
    wave = slope * 2 * np.pi / wave_mm * np.cos(2 * np.pi * offsets / wave_mm + rng.uniform(0, 2 * np.pi))
    kind = rng.integers(3)
    return np.asarray((kind != 1) * roll * (0.4 if kind == 2 else 1.0) + (kind != 0) * wave)


def _parallel(offsets: Floats, _: np.random.Generator) -> Floats:
    return np.zeros(len(offsets))


def _fanning(offsets: Floats, rng: np.random.Generator) -> Floats:
    """Through an apex beyond the border: a cone."""
    return np.asarray(np.arctan((offsets - rng.uniform(-100, 100)) / (REACH_MM * rng.uniform(1.3, 6.0))))


def _varying(offsets: Floats, rng: np.random.Generator) -> Floats:
    """A sine of the offset, slow enough that no two rulings meet on the page."""
    length = rng.uniform(150, 600)
    most = CROSSING / REACH_MM * length / (2 * np.pi)
    return np.asarray(rng.uniform(0.3, 1.0) * most * np.sin(2 * np.pi * offsets / length + rng.uniform(0, 2 * np.pi)))


RULINGS = {"parallel": _parallel, "fanning": _fanning, "varying": _varying}


def _curved(sheet: Warp, rng: np.random.Generator) -> Warp:
    """A sheet mirrored at a plane through one of its points, which leans from the sheet there."""
    at = rng.uniform(-0.25, 0.25, 2) * PAGE_MM
    point, right, up = sheet(at + np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]]))
    right, up = (right - point) / np.linalg.norm(right - point), (up - point) / np.linalg.norm(up - point)
    lean, way = np.radians(rng.uniform(*CURVED_DEG)), rng.uniform(0, 2 * np.pi)
    normal = np.cos(lean) * np.cross(right, up) + np.sin(lean) * (np.cos(way) * right + np.sin(way) * up)
    normal /= np.linalg.norm(normal)
    return Mirrored(sheet, np.append(normal, normal @ point))


def _miura(rng: np.random.Generator) -> Warp:
    side, width = rng.uniform(35, 100, 2)
    sheet = Miura(side_mm=side, width_mm=width, acute_deg=rng.uniform(55, 85), fold_deg=rng.uniform(5, 45))
    return lambda paper: sheet.warp(paper, PAGE_MM)


def _vertex_folds(rng: np.random.Generator) -> Warp:
    sheet = Crumpled(
        planes=int(rng.integers(2, 9)),
        tilt_deg=rng.uniform(4, 14),
        steep_deg=rng.uniform(20, 50),
        seed=int(rng.integers(2**31)),
    )
    return lambda paper: sheet.warp(paper, PAGE_MM)


def random_sheet(rng: np.random.Generator, spacing_mm: float) -> tuple[str, Warp]:
    """Family and sheet; spacing_mm between the points that will sample it."""
    family = str(rng.choice(FAMILIES))
    if family == "Miura":
        return family, _miura(rng)
    if family == "vertex folds":
        return family, _vertex_folds(rng)
    folds = 0 if family in ("bent", "curved crease") else int(rng.integers(1, MAX_FOLDS + 1))
    sheet: Warp = _ruled(rng, spacing_mm, bent=family != "folded", folds=folds)
    return family, _curved(sheet, rng) if family in ("curved crease", "mixed") else sheet


FAMILIES = ("bent", "folded", "curved crease", "mixed", "Miura", "vertex folds")

"""Opened books of known spine, of five families, and sheets that are none, drawn at random."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from scipy.interpolate import PchipInterpolator

from drivers.scanner import SettingsError
from drivers.simulated import (
    Binding,
    Cone,
    Crumpled,
    Curl,
    Engraving,
    Facing,
    Figure,
    Flat,
    Miura,
    MultiFold,
    Opening,
    Pose,
    Text,
    Truth,
    Wave,
    shoot,
)
from drivers.simulated.scene.artwork import Artwork
from drivers.simulated.scene.sheets.bent import Bent, Slope
from drivers.simulated.scene.sheets.sheet import PageSize, Sheet, parameters
from restore.scan import Floats, RangeScan

Random = np.random.Generator


@parameters
class SplineOpening(Bent):
    """Each leaf follows a monotone spline through random slopes: no exponential, walls unequal.

    knots_mm, left_deg, right_deg: distances from the gutter and the slope of each wall there.
    """

    name: ClassVar[str] = "spline opening"
    offset_mm: int = 0
    knots_mm: tuple[float, ...] = (0.0, 10.0, 30.0, 80.0, 300.0)
    left_deg: tuple[Slope, ...] = (50.0, 30.0, 8.0, 0.0, 0.0)
    right_deg: tuple[Slope, ...] = (50.0, 30.0, 8.0, 0.0, 0.0)

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002
        """(…) rad: the spline of the side on which a length lies."""
        u = s - self.offset_mm
        sides = [
            PchipInterpolator(self.knots_mm, np.radians(wall))(np.abs(u)) for wall in (self.left_deg, self.right_deg)
        ]
        return np.asarray(np.where(u < 0, -sides[0], sides[1]))


@parameters
class StepOpening(Bent):
    """A book opened near its front or back: one block stands higher, its leaf falls steeply over its edge.

    step_mm  length of paper that falls at wall_deg, from the gutter on; the leaf then turns flat over turn_mm.
    """

    name: ClassVar[str] = "step opening"
    offset_mm: int = 0
    high_left: bool = True
    wall_deg: Slope = 72.0
    step_mm: int = 8
    turn_mm: float = 15.0
    low_deg: Slope = 20.0
    low_reach_mm: float = 30.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002
        """(…) rad: a wall and a quarter of a cosine on the high side, an exponential on the low one."""
        u = (s - self.offset_mm) * (-1.0 if self.high_left else 1.0)  # positive on the high side
        over = np.clip((u - self.step_mm) / self.turn_mm, 0.0, 1.0)
        high = np.radians(self.wall_deg) * 0.5 * (1.0 + np.cos(np.pi * over))
        low = -np.radians(self.low_deg) * np.exp(np.minimum(u, 0.0) / self.low_reach_mm)
        return np.asarray(np.where(u >= 0, high, low) * (-1.0 if self.high_left else 1.0))


@parameters
class CradleOpening(Bent):
    """A stiff binding that opens to 90–120° in a cradle: both leaves slant, and bend a little at their hinge."""

    name: ClassVar[str] = "cradle opening"
    offset_mm: int = 0
    left_deg: Slope = 35.0
    right_deg: Slope = 35.0
    hinge_deg: Annotated[float, Field(ge=0, le=30)] = 10.0
    hinge_mm: float = 15.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002
        """(…) rad: constant, steeper by hinge_deg at the gutter."""
        u = s - self.offset_mm
        hinge = np.radians(self.hinge_deg) * np.exp(-((u / self.hinge_mm) ** 2))
        return np.asarray(np.where(u < 0, -np.radians(self.left_deg) - hinge, np.radians(self.right_deg) + hinge))


@parameters
class Card(Bent):
    """A card folded once, its panels flat or sprung into a curve of the other sign than a page's."""

    name: ClassVar[str] = "card"
    offset_mm: int = 0
    left_deg: Slope = 25.0
    right_deg: Slope = 25.0
    sprung_deg: Annotated[float, Field(ge=0, le=20)] = 0.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:
        """(…) rad: of two panels, each steeper towards its outer edge by sprung_deg."""
        u = s - self.offset_mm
        sprung = np.radians(self.sprung_deg) * np.minimum(np.abs(u) / (page_mm[0] / 2), 2.0)
        return np.asarray(np.where(u < 0, -np.radians(self.left_deg) - sprung, np.radians(self.right_deg) + sprung))


@dataclass(frozen=True)
class Drawn:
    """A sheet with its print and its place under the scanner.

    spine_mm  of an opening, from the left edge; None for a sheet that is none.
    plate     whether one picture is printed across the spine.
    """

    family: str
    sheet: Sheet
    artwork: Artwork
    page_mm: PageSize
    pose: Pose
    spine_mm: float | None = None
    plate: bool = False


def draw_opening(seed: int, family: str | None = None, *, plate: bool = False) -> Drawn:
    """An opening of a family of `OPENINGS`, of the seed's own by default."""
    random = np.random.default_rng([seed, 62])
    family = family or list(OPENINGS)[seed % len(OPENINGS)]
    width, height = random.uniform(200, 275), random.uniform(140, 200)
    offset = int(random.integers(-25, 26))
    spine = width / 2 + offset
    kinds = ("text", "text", "text", "figure", "white")
    left, right = random.choice(kinds), random.choice(kinds)
    margin, columns = float(random.uniform(6, 16)), int(random.integers(1, 3))
    art: Artwork = Facing(left, right, left_mm=spine, margin_mm=margin, columns=columns, seed=seed)
    if plate:
        lines = Text(seed=seed, title_pt=18.0, sizes_pt=(12.0,))
        art = (Figure(), lines, Engraving(seed=seed), Text(seed=seed, columns=2))[seed // len(OPENINGS) % 4]
    return Drawn(family, OPENINGS[family](random, offset), art, (width, height), _pose(random), spine, plate)


def draw_other(seed: int) -> Drawn:
    """A sheet that is not an opened book."""
    random = np.random.default_rng([seed, 63])
    family = list(OTHERS)[seed % len(OTHERS)]
    page_mm = (random.uniform(180, 275), random.uniform(140, 200))
    art: Artwork = (Text(seed=seed), Text(seed=seed, columns=2), Figure())[int(random.integers(3))]
    if family in ("card", "sprung card"):  # printed as a book is, page by page: only its shape is another
        art = Facing(left_mm=page_mm[0] / 2, seed=seed)
    return Drawn(family, OTHERS[family](random), art, page_mm, _pose(random))


def _pose(random: Random) -> Pose:
    return Pose(tilt_deg=random.uniform(-6, 6), turn_deg=random.uniform(-4, 4))


def _exponential(random: Random, offset: int) -> Sheet:
    walls, reaches = random.uniform(15, 66, 2), random.uniform(12, 45, 2)
    return Opening(walls[0], walls[1], reaches[0], reaches[1], offset)


def _spline(random: Random, offset: int) -> Sheet:
    knots = (0.0, random.uniform(4, 12), random.uniform(16, 40), random.uniform(55, 90), 320.0)
    sides = []
    for _ in range(2):
        wall = random.uniform(18, 65)
        falls = np.cumprod(random.uniform([0.5, 0.1, 0.0], [1.0, 0.6, 0.4]))
        sides.append((wall, *(wall * falls), random.uniform(-4, 4)))
    return SplineOpening(offset, knots, *(tuple(map(float, side)) for side in sides))


def _step(random: Random, offset: int) -> Sheet:
    wall, turn, low, reach = random.uniform([50, 8, 4, 15], [74, 30, 30, 45])
    return StepOpening(offset, bool(random.integers(2)), wall, int(random.integers(2, 14)), turn, low, reach)


def _cradle(random: Random, offset: int) -> Sheet:
    left, right = random.uniform(28, 42, 2)
    return CradleOpening(offset, left, right, random.uniform(4, 20), random.uniform(8, 20))


def _shallow(random: Random, offset: int) -> Sheet:
    walls, reaches = random.uniform(6, 15, 2), random.uniform(12, 45, 2)
    return Opening(walls[0], walls[1], reaches[0], reaches[1], offset)


OPENINGS: dict[str, Callable[[Random, int], Sheet]] = {
    "exponential": _exponential,
    "spline": _spline,
    "step": _step,
    "cradle": _cradle,
}
SHALLOW = _shallow

OTHERS: dict[str, Callable[[Random], Sheet]] = {
    "binding": lambda random: Binding(slope_deg=random.uniform(20, 70), reach_mm=random.uniform(12, 60)),
    "curl": lambda random: Curl(random.uniform(70, 300) * random.choice([-1, 1]), random.uniform(-0.5, 0.5)),
    "wave": lambda random: Wave(
        random.uniform(8, 30), random.uniform(60, 200), random.uniform(-90, 90), random.uniform(-180, 180)
    ),
    "letter": lambda _: MultiFold(),
    "card": lambda random: Card(int(random.integers(-20, 21)), *random.uniform(8, 40, 2)),
    "sprung card": lambda random: Card(0, *random.uniform(8, 35, 2), random.uniform(2, 15)),
    "flat": lambda _: Flat(),
    "cone": lambda _: Cone(),
    "miura": lambda random: Miura(side_mm=random.uniform(25, 45), fold_deg=random.uniform(20, 45)),
    "crumpled": lambda random: Crumpled(seed=int(random.integers(1000))),
}


def shoot_drawn(drawn: Drawn, seed: int, mode: Literal["fast", "fine"]) -> tuple[RangeScan, Truth] | None:
    """Capture what was drawn, with its truth; None for a sheet that folds over itself before the scanner."""
    try:
        return shoot(drawn.sheet, drawn.artwork, page_mm=drawn.page_mm, pose=drawn.pose, seed=seed, mode=mode)
    except SettingsError:
        return None

"""Sheets bent about parallel rulings: flat, rolled, bound, an open book, a wave.

Each is given by the slope of its profile as a function of the length s along the paper. The profile, and with it the
sheet, then has unit speed whatever the slope: x(s) = ∫ cos φ ds, z(s) = ∫ sin φ ds, and the map keeps lengths exactly.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from drivers.simulated.scene.sheets.rulings import cross_border, ruled_mesh
from drivers.simulated.scene.sheets.sheet import PageSize, corners, direction, parameters
from restore.scan import Floats, Ints

RULING_MM = 0.25  # chords this long stay within 0.4 µm of the tightest bend here (curvature 0.05 per mm)
TIGHTEST_MM = 20.0  # the bend at which RULING_MM was chosen
PANEL_MM = 1.0  # five Gauss points on each integrate slopes that vary over 5 mm and more to rounding
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)

Angle = Annotated[float, Field(ge=-180, le=180)]
Slope = Annotated[float, Field(ge=-80, le=80)]  # steeper walls hide from the camera


class Bent:
    """Sheet bent about rulings at right angles to `angle_deg`.

    Subclasses give the slope of the profile.
    """

    angle_deg: float = 0.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:
        """Return the slope (…) rad of the profile at lengths (…) mm from the centre of the page.

        It may jump at s = 0 only.
        """
        raise NotImplementedError

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:
        """Map points (…, 2) mm of the flat page to space, (…, 3) mm."""
        across, along = direction(self.angle_deg), direction(self.angle_deg + 90)
        x, z = self._profile(paper @ across, page_mm)
        return np.concatenate([x[..., None] * across + (paper @ along)[..., None] * along, z[..., None]], axis=-1)

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """Strips along the rulings: points (n, 2) mm of the flat page and triangles (m, 3)."""
        across, along = direction(self.angle_deg), direction(self.angle_deg + 90)

        def cut(s: Floats) -> Floats:
            return cross_border(page_mm, s[:, None] * across, np.broadcast_to(along, (len(s), 2)))

        return ruled_mesh(page_mm, lambda p: p @ across, cut, RULING_MM)

    def _profile(self, s: Floats, page_mm: PageSize) -> tuple[Floats, Floats]:
        """Coordinates x(s), z(s) mm, zero at s = 0, by Gauss quadrature on panels."""
        panel = np.floor(s / PANEL_MM).astype(int)
        first = min(panel.min(initial=0), 0)
        whole = self._integral(np.arange(first, panel.max(initial=0) + 1) * PANEL_MM, np.array(PANEL_MM), page_mm)
        total = np.concatenate([np.zeros((2, 1)), np.cumsum(whole, axis=1)], axis=1)
        start = panel * PANEL_MM
        here, middle = total[:, panel - first], total[:, -first].reshape(2, *[1] * s.ndim)
        x, z = here - middle + self._integral(start, s - start, page_mm)
        return x, z

    def _integral(self, start: Floats, length: Floats, page_mm: PageSize) -> Floats:
        """Integrate cos φ and sin φ over intervals (…), (2, …).

        They begin at start (…).
        """
        half = np.asarray(length)[..., None] / 2
        slope = self.slope(start[..., None] + half * (1 + NODES), page_mm)
        return np.stack([np.sum(f(slope) * WEIGHTS * half, axis=-1) for f in (np.cos, np.sin)])


@parameters
class Flat(Bent):
    """A sheet that lies flat."""

    name: ClassVar[str] = "flat"

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Return the slope (…) rad: zero everywhere."""
        return np.zeros_like(s)

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """Vertices (4, 2) mm and faces (2, 3): two triangles."""
        return corners(page_mm), np.array([[0, 1, 2], [0, 2, 3]])


def _rollable(radius_mm: float) -> float:
    if abs(radius_mm) < TIGHTEST_MM:
        raise ValueError(f"a radius of {TIGHTEST_MM:g} or more, or of −{TIGHTEST_MM:g} or less, is needed")
    return radius_mm


@parameters
class Curl(Bent):
    """A sheet that was kept rolled up.

    radius_mm  of the bend at the middle of the page; positive lifts the middle, negative the edges.
    taper      how much tighter than the middle it is at the right edge (and wider at the left), as a fraction.
    """

    name: ClassVar[str] = "curl"
    radius_mm: Annotated[float, AfterValidator(_rollable)] = 170.0
    taper: Annotated[float, Field(ge=-0.9, le=0.9)] = 0.3
    angle_deg: Angle = 0.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:
        """Return the slope (…) rad, the curvature integrated from the centre.

        The curvature is −(1 + taper·s/half) / radius.
        """
        half = page_mm[0] / 2
        return -(s + self.taper * s**2 / (2 * half)) / self.radius_mm


@parameters
class Binding(Bent):
    """Right-hand page of a thick book.

    The slope falls off with the distance from the spine at the left edge.
    slope_deg: at the spine.
    reach_mm: distance over which the slope falls to 1/e.
    """

    name: ClassVar[str] = "binding"
    slope_deg: Slope = 55.0
    reach_mm: Annotated[float, Field(ge=8, le=200)] = 30.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:
        """Return the slope (…) rad: at the spine times exp(−distance / reach)."""
        return np.radians(self.slope_deg) * np.exp(-(s + page_mm[0] / 2) / self.reach_mm)


@parameters
class Spread(Bent):
    """Two facing pages of a thick book, with a sharp gutter in the middle.

    slope_deg  of both walls at the gutter.
    reach_mm   distance over which the slope falls to 1/e.
    """

    name: ClassVar[str] = "spread"
    slope_deg: Slope = 66.0
    reach_mm: Annotated[float, Field(ge=8, le=200)] = 25.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Return the slope (…) rad, rising on both sides of the gutter, as exp(−distance / reach)."""
        return np.sign(s) * np.radians(self.slope_deg) * np.exp(-np.abs(s) / self.reach_mm)


@parameters
class Wave(Bent):
    """A sheet that lies in waves, as damp paper dries, at an angle to its edges."""

    name: ClassVar[str] = "wave"
    slope_deg: Slope = 30.0
    wavelength_mm: Annotated[float, Field(ge=30, le=2000)] = 120.0
    angle_deg: Angle = 25.0
    phase_deg: Angle = 0.0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Return the slope (…) rad: a sine of the length along the paper."""
        return np.radians(self.slope_deg) * np.sin(2 * np.pi * s / self.wavelength_mm + np.radians(self.phase_deg))

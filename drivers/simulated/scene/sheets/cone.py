"""A sheet bent about rulings that meet in a point outside it."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.scene.sheets.rulings import cross_border, ruled_mesh
from drivers.simulated.scene.sheets.sheet import PageSize, direction, parameters
from restore.scan import Floats, Ints

RULING_RAD = 0.0007  # at the 350 mm to the far corners, the same quarter of a millimetre as for the bent sheets


@parameters
class Cone:
    """A page laid on a circular cone, its middle ruling up.

    apex_mm      from the middle of the page to the apex; the page must not reach it.
    opening_deg  half of the cone's opening angle: 90 is flat.
    angle_deg    direction from the apex to the middle of the page.
    """

    name: ClassVar[str] = "cone"
    apex_mm: Annotated[float, Field(ge=50, le=5000)] = 320.0
    opening_deg: Annotated[float, Field(ge=10, le=90)] = 38.0
    angle_deg: Annotated[float, Field(ge=-180, le=180)] = 20.0

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Map points of the flat page to space, (…, 3) mm.

        Polar angle ψ about the apex becomes ψ / sin(opening) about the axis; distances from it stay.
        """
        along, across = direction(self.angle_deg), direction(self.angle_deg + 90)
        sin, cos = np.sin(np.radians(self.opening_deg)), np.cos(np.radians(self.opening_deg))
        from_apex, turn = paper + self.apex_mm * along, self._angle(paper) / sin
        distance = np.linalg.norm(from_apex, axis=-1)
        forward = distance * (cos**2 + sin**2 * np.cos(turn)) - self.apex_mm
        sideways, up = distance * sin * np.sin(turn), -distance * sin * cos * (1 - np.cos(turn))
        return np.concatenate([forward[..., None] * along + sideways[..., None] * across, up[..., None]], axis=-1)

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """Strips along the rulings: points (n, 2) mm of the flat page and triangles (m, 3)."""
        along, across = direction(self.angle_deg), direction(self.angle_deg + 90)

        def cut(angle: Floats) -> Floats:
            inward = -np.cos(angle)[:, None] * along - np.sin(angle)[:, None] * across
            return cross_border(page_mm, np.broadcast_to(-self.apex_mm * along, inward.shape), inward)

        return ruled_mesh(page_mm, self._angle, cut, RULING_RAD)

    def _angle(self, paper: Floats) -> Floats:
        """Return the polar angle (…) rad about the apex, zero through the centre of the page."""
        along, across = direction(self.angle_deg), direction(self.angle_deg + 90)
        from_apex = paper + self.apex_mm * along
        return np.arctan2(from_apex @ across, from_apex @ along)

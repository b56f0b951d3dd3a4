"""An opened book whose two leaves differ."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from drivers.simulated.scene.sheets.bent import Bent, Slope
from drivers.simulated.scene.sheets.sheet import PageSize, parameters
from restore.scan import Floats

Reach = Annotated[float, Field(ge=8, le=200)]


@parameters
class Opening(Bent):
    """Two leaves of a book that meet at the gutter, each with its own slope.

    left_deg, right_deg            slope of each wall at the gutter.
    left_reach_mm, right_reach_mm  distance over which the slope falls to 1/e.
    offset_mm                      of the gutter, right of the middle of the sheet; whole millimetres, as the slope may
                                   jump between panels only.
    """

    name: ClassVar[str] = "opening"
    left_deg: Slope = 50.0
    right_deg: Slope = 50.0
    left_reach_mm: Reach = 25.0
    right_reach_mm: Reach = 25.0
    offset_mm: int = 0

    def slope(self, s: Floats, page_mm: PageSize) -> Floats:  # noqa: ARG002 (the same on every page)
        """Return the slope (…) rad at a gutter, falling left and rising right: exp(−s / reach)."""
        u = s - self.offset_mm
        left = -np.radians(self.left_deg) * np.exp(u / self.left_reach_mm, where=u < 0, out=np.zeros_like(u))
        right = np.radians(self.right_deg) * np.exp(-u / self.right_reach_mm, where=u >= 0, out=np.zeros_like(u))
        return np.asarray(np.where(u < 0, left, right))

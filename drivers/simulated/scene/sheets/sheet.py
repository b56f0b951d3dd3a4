"""Sheet of paper: a map from the flat page into space, and a mesh.

The map keeps every length; the mesh has its edges on the creases. Paper coordinates are millimetres from the centre of
the page, x right, y up; space has z towards the reader. Sheets know nothing of the scanner: the scene places them.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

import numpy as np
from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from restore.scan import Floats, Ints

PageSize = tuple[float, float]

# Parameters come straight from a station configuration: an unknown name or a number out of range is refused there and
# then.
parameters: Any = dataclass(frozen=True, config=ConfigDict(extra="forbid"))


class Sheet(Protocol):
    """A way to warp a page without stretching it."""

    name: ClassVar[str]

    def warp(self, paper: Floats, page_mm: PageSize) -> Floats:
        """Map points (…, 2) mm of the flat page to space, (…, 3) mm."""
        ...

    def mesh(self, page_mm: PageSize) -> tuple[Floats, Ints]:
        """Return points (n, 2) mm of the flat page and triangles (m, 3).

        Counter-clockwise; they carry the warped page.
        """
        ...


def corners(page_mm: PageSize) -> Floats:
    """Return the corners (4, 2) mm of the page, counter-clockwise from the lower left."""
    return np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(page_mm) / 2


def direction(angle_deg: float) -> Floats:
    """Return the unit vector (2,) at an angle to the x axis."""
    return np.array([np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))])

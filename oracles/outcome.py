"""A random sheet flattened, and whether it failed, has inverted or overlapping triangles, or is strained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from oracles.markers import rigid_residual
from oracles.overlaps import overlapping_pairs
from oracles.random_sheets import RandomSheet
from restore import RestoreError, flatten

MAX_STRAIN = 0.02  # rms over the edges of a sheet, against their lengths measured on the surface


@dataclass(frozen=True)
class Outcome:
    """The result for one sheet: message of the error that was raised (failed), counts, and rms strain and error."""

    sheet: RandomSheet
    failed: str = ""
    flips: int = 0
    overlaps: int = 0
    strain: float = 0.0
    rms_mm: float = 0.0

    @property
    def acceptable(self) -> bool:
        """Whether it was flattened without inverted triangles, overlaps or more than MAX_STRAIN."""
        return not (self.failed or self.flips or self.overlaps or self.strain > MAX_STRAIN)


def flatten_and_compare(sheet: RandomSheet) -> Outcome:
    """Flatten a sheet with the default settings and compare it with its flat truth."""
    try:
        page = flatten(sheet.mesh)
    except RestoreError as error:
        return Outcome(sheet, failed=str(error))
    rest, _ = rigid_residual(page.flat, sheet.flat)
    return Outcome(
        sheet,
        flips=page.flipped,
        overlaps=len(overlapping_pairs(page.flat, page.faces)),
        strain=float(np.sqrt((page.strain**2).mean())),
        rms_mm=float(np.sqrt((rest**2).sum(axis=1).mean())),
    )

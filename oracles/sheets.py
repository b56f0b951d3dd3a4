"""The sheets of the bench: 280 × 200 mm before the MIDDLE lens at 0.9 m, with what their pages may be off by."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.simulated import Binding, Cone, Crumpled, Curl, Flat, Miura, MultiFold, Spread, Wave
from drivers.simulated.scene.sheets import Sheet


@dataclass(frozen=True)
class Case:
    """A sheet and the most that its marker corners may be off, mm rms; the floor through a 640×480 picture is 0.10."""

    sheet: Sheet
    limit_mm: float


CASES = {
    "flat": Case(Flat(), 0.13),
    "curl": Case(Curl(), 0.13),
    "wave": Case(Wave(), 0.13),
    "cone": Case(Cone(), 0.13),
    "multi-fold": Case(MultiFold(), 0.13),
    "binding": Case(Binding(), 0.13),
    "Miura fold": Case(Miura(), 0.16),
    "deep gutter": Case(Spread(slope_deg=66.0), 0.20),
    # Creases of a few degrees drown in the noise.
    "crumpled": Case(Crumpled(), 0.20),
}

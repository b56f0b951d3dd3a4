"""Limits beyond which the surface of a scan cannot be a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from restore import NotEnoughSurface

# Paper tears at 3 % of strain and parchment, which stretches most of what is written on, at 20 to 30 %: a surface whose
# edges change by more than that, rms over all of them, was never flat, and lengths on its page mean nothing.
MAX_STRAIN = 0.3
# Fraction of the triangles. A flat sheet has none, a noisy border some in a thousand; from this on, a line of text in
# twenty lies mirrored over another.
MAX_INVERTED = 0.05


def check_plausible_page(report: Mapping[str, Any], faces: int) -> None:
    """Raise NotEnoughSurface when a report shows an impossible page.

    faces: number of triangles of the page.
    """
    strain, inverted = report["strain"]["rms"], report["flipped_faces"]
    if strain > MAX_STRAIN or inverted > MAX_INVERTED * faces:
        raise NotEnoughSurface(
            f"the surface is not a page: flattened it has {strain:.0%} rms strain (limit {MAX_STRAIN:.0%}) and "
            f"{inverted} of {faces} triangles inverted (limit {MAX_INVERTED:.0%})",
            "scan a sheet by itself, or cut it out of the mesh; --allow-distorted writes the page all the same",
        )

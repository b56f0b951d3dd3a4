"""The uncertainty of the places of a page as a layer, and its scale."""

from __future__ import annotations

from typing import Any

import numpy as np

from restore.scan import Bytes, Floats
from station.console.shown_pages.layers import file_of_layer, opened, stored_file
from station.console.shown_pages.strain import coloured, end_of_scale, hexadecimal
from station.console.shown_pages.tiles import StoredPyramid, build_pyramid
from station.pictures.strain import UNSIGNED
from station.session import Event, Session
from station.session.terms.parts import PAGE


def uncertainty_pyramid(session: Session, event: Event, prefix: str = "") -> StoredPyramid:
    """Draw the uncertainty of a page or leaf of a restoration.

    Raises ConsoleFault, BadInput, OSError.
    """
    return build_pyramid(draw_uncertainty(_values(session, event, prefix)))


def uncertainty_scale(session: Session, event: Event, prefix: str = "") -> dict[str, Any]:
    """Return the scale of the uncertainty: its colours, its end, the report's figures, mm.

    Raises ConsoleFault, BadInput, OSError.
    """
    values = _values(session, event, prefix)
    result = event.restored.leaves.get(prefix.removesuffix(".") or PAGE, event.restored) if event.restored else None
    return {
        "unit": "mm",
        "uncertainty_mm": (result and result.uncertainty_mm) or {},
        "end": end_of_scale(values),
        "colours": hexadecimal(UNSIGNED),
    }


def draw_uncertainty(values: Floats) -> Bytes:
    """Draw standard deviations (h, w) mm as (h, w, 4), transparent where they are NaN."""
    known = np.isfinite(values)
    return coloured(np.where(known, values, 0.0) / end_of_scale(values), known, UNSIGNED)


def _values(session: Session, event: Event, prefix: str) -> Floats:
    path = stored_file(session, event, file_of_layer(f"{prefix}uncertainty"))
    with opened(path, ("TIFF",)) as picture:
        return np.asarray(picture.convert("F"))

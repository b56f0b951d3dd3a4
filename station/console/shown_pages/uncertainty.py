"""The uncertainty of the places of a page as a layer, and its scale."""

from __future__ import annotations

from typing import Any

import numpy as np

from restore.scan import Bytes, Floats
from station.console.shown_pages.layers import file_of_layer, opened, stored_file
from station.console.shown_pages.tiles import StoredPyramid, build_pyramid
from station.pictures.strain import UNSIGNED, round_up
from station.session import Event, Session
from station.session.terms.parts import PAGE

SHOWN_PERCENT = 99.0  # of the pixels are within the scale: one corner must not hide the rest
OPACITY = 190
COLOURS = 256  # between the ends of the scale


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
        "colours": ["#{:02x}{:02x}{:02x}".format(*colour.astype(int)) for colour in UNSIGNED],
    }


def draw_uncertainty(values: Floats) -> Bytes:
    """Draw standard deviations (h, w) mm as a picture (h, w, 4).

    Transparent where they are NaN.
    """
    anchors = np.linspace(0.0, COLOURS - 1.0, len(UNSIGNED))
    channels = [np.interp(np.arange(COLOURS), anchors, channel) for channel in UNSIGNED.T]
    table = np.column_stack([*channels, np.full(COLOURS, OPACITY)]).astype(np.uint8)
    known = np.isfinite(values)
    fraction = np.clip(np.where(known, values, 0.0) / end_of_scale(values), 0.0, 1.0)
    picture = table[np.rint(fraction * (COLOURS - 1)).astype(np.uint8)]
    picture[~known, 3] = 0
    return np.asarray(picture)


def end_of_scale(values: Floats) -> float:
    """Return the greatest standard deviation of the colours, of (h, w) mm.

    >>> end_of_scale(np.array([[0.003, 0.011, np.nan]]))
    0.02
    """
    known = values[np.isfinite(values)]
    return round_up(float(np.percentile(known, SHOWN_PERCENT)) if known.size else 0.0)


def _values(session: Session, event: Event, prefix: str) -> Floats:
    path = stored_file(session, event, file_of_layer(f"{prefix}uncertainty"))
    with opened(path, ("TIFF",)) as picture:
        return np.asarray(picture.convert("F"))

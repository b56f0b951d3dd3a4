"""Describe the calibration of a scan, and how far the size of a page may be off by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, sqrt
from typing import Any

from restore.outline.picture_edge import SHOWN
from restore.scan import Provenance
from restore.texture.page import MM_PER_INCH

NORMAL_95 = 1.96  # standard deviations: 95 % of a normal distribution
NOMINAL_LENGTH = 0.005  # of a length, one standard deviation: the assumed deviation of bodies from the manual's figures
DEVIATIONS = ("distortion", "plane", "tilt", "bow")  # of a body; the manual has none of them
MEASURED = ("date", "captures", "markers_px", "lines_rms", "expected_mm", "expected_length")


def describe_calibration(provenance: Provenance) -> dict[str, Any]:
    """Describe the calibration of a scan as JSON values.

    `nominal` is that of the manual for all bodies, `unknown` that of another program's scan.

    >>> describe_calibration({})
    {'kind': 'unknown'}
    >>> describe_calibration({"calibration": {"distortion": [0.0, 0.0], "plane": [0.0] * 4, "tilt": 0.0, "bow": 0.0}})
    {'kind': 'nominal'}
    """
    table = provenance.get("calibration")
    if not isinstance(table, Mapping) or not all(name in table for name in DEVIATIONS):
        return {"kind": "unknown"}
    measured = table.get("measured")
    if isinstance(measured, Mapping):
        return {"kind": "measured", **{name: measured.get(name) for name in MEASURED}}
    if any(value for name in DEVIATIONS for value in _numbers(table[name])):
        return {"kind": "measured", **dict.fromkeys(MEASURED)}
    return {"kind": "nominal"}


def edge_error(ppi: float) -> float:
    """Return the standard deviation of a side of a page by its edges, mm.

    An edge in the picture is anywhere within SHOWN, all along.
    ppi: pixels of the picture to an inch of the page; 0 without one.
    """
    return sqrt(2.0 / 3.0) * SHOWN * MM_PER_INCH / ppi if ppi else 0.0


def size_interval(
    described: Mapping[str, Any], page_mm: Sequence[float], sides_mm: Sequence[float] = (0.0, 0.0)
) -> list[float] | None:
    """Return half the 95 % intervals of width and height, mm; None where unknown.

    described: as `describe_calibration` gives it; sides_mm: further standard deviations of the sides.
    """
    if described["kind"] == "nominal":
        errors = [NOMINAL_LENGTH * side for side in page_mm]
    elif described.get("expected_length") is not None:
        errors = [float(described["expected_length"]) * side for side in page_mm]
    elif described.get("expected_mm") is not None:
        # An older calibration: a side is the difference of two places, each with the error of a place.
        errors = [sqrt(2.0) * float(described["expected_mm"])] * len(page_mm)
    else:
        return None
    return [NORMAL_95 * hypot(one, other) for one, other in zip(errors, sides_mm, strict=True)]


def _numbers(value: Any) -> Sequence[float]:
    return value if isinstance(value, list | tuple) else (value,)

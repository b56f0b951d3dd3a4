"""Refuse sizes that no page has."""

from __future__ import annotations

import numpy as np

from restore.errors import BadInput
from restore.mesh.adjacency import used_vertices
from restore.numerics.units import GIVEN, MAX_COORDINATE_MM, UNIT_MM, UNSTATED
from restore.scan import RangeScan, SurfaceMesh

MIN_PAGE_MM = 20.0  # mm of the longest side: a postage stamp has 24, an A3 page in inches 16.5
MAX_PAGE_MM = 10_000.0  # mm: four times what the scanner sees; a Letter page in inches, read as metres, has 11,000
MIN_SIDE_MM = 1.0  # mm, whatever the unit: less than two samples of the scanner at its nearest
FAR = 10.0  # of its size from the origin, and farther than any scanner sees: coordinates of a map, not of a page


def check_size(scan: RangeScan | SurfaceMesh) -> None:
    """Raise BadInput for a size that no page has.

    Unless the unit was given; and for a surface far from its origin.
    """
    if isinstance(scan, RangeScan):
        points = scan.points[scan.measured]
    else:
        points = scan.vertices[used_vertices(scan.faces, len(scan.vertices))]
    if len(points) == 0:  # reported elsewhere
        return
    low, high = np.array([(axis.min(), axis.max()) for axis in points.T]).T  # axis by axis it takes a third of the time
    far = float(max(-low.min(), high.max()))
    if far > MAX_COORDINATE_MM and far > FAR * float((high - low).max()):
        raise BadInput(
            f"the surface lies {far / 1e6:.3g} km from the origin of its coordinates, too far to be exact",
            "subtract its middle from all its points: map coordinates, say, are such",
        )
    long, wide = np.sort(high - low)[:0:-1]
    given = scan.provenance.get("unit_source") == GIVEN
    least, most = (MIN_SIDE_MM, np.inf) if given else (MIN_PAGE_MM, MAX_PAGE_MM)
    if not least <= long <= most:
        unit = str(scan.provenance.get("unit", UNSTATED))
        raise BadInput(
            f"the whole surface measures {_metric(long)} × {_metric(wide)}: is {unit} its unit?",
            _other_units(long, unit),
        )


def _other_units(size: float, unit: str) -> str:
    """Return the hint for a surface read in the wrong unit.

    It names the units that would make a page of it.
    size: mm, as read in `unit`.
    """
    sizes = {name: size * factor / UNIT_MM.get(unit, 1.0) for name, factor in UNIT_MM.items()}
    pages = [f"{name} ({_metric(mm)})" for name, mm in sizes.items() if MIN_PAGE_MM <= mm <= MAX_PAGE_MM]
    which = f", which can be {', '.join(pages)}" if pages else ""
    return f"give the unit of the file with --unit where the command has it{which}; coordinates are in millimetres"


def _metric(size: float) -> str:
    return f"{size:.3g} mm" if size < 1000.0 else f"{size / 1000:.3g} m"

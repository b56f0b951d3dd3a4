"""Units of length of scan files, and the greatest coordinate that a scan may have."""

from __future__ import annotations

# The scanner sees 2.5 m; a coordinate beyond 100 m is a damaged number.
MAX_COORDINATE_MM = 1e5
UNIT_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
UNSTATED = "mm"  # what scanners' software writes into formats that have no unit
GIVEN, BY_FORMAT, ASSUMED = "given", "format", "assumed"

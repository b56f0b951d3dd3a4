"""Optical constants of the VIVID 900 and 910.

The driver and the readers of its files use them. Source: VIVID 910 hardware manual (Minolta 9222-1888-19), pages as
given.
"""

from __future__ import annotations

from types import MappingProxyType

TEXTURE_ROWS, TEXTURE_COLS = 480, 640
"""Size of the colour image in every mode (p. 56)."""

FOCAL_PX = MappingProxyType({"TELE": 3454.7, "MIDDLE": 1942.8, "WIDE": 1070.2})
"""Lens name → focal length in texture pixels.

From the straight line through the fields of view of p. 26.
"""

WRITTEN_MM = 0.01
"""To which files of its software are rounded."""

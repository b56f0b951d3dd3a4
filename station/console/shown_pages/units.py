"""Units of the measures of a verdict."""

from __future__ import annotations

UNITS = {
    "covered_share": "share",
    "hole_mm": "mm",
    "cut_share": "share",
    "depth_share": "share",
    "strain_rms": "share",
    "effective_ppi": "ppi",
    "blur_px": "px",
    "clipped_share": "share",
    "left_out_fraction": "share",
    "similarity": "",
}

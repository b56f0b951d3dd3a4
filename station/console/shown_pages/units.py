"""Units of the measures of a verdict."""

from __future__ import annotations

UNITS = {
    "measured_fraction": "fraction",
    "hole_mm": "mm",
    "cropped_fraction": "fraction",
    "depth_window_fraction": "fraction",
    "smooth_strain_rms": "fraction",
    "sampling_ppi": "ppi",
    "blur_px": "px",
    "clipped_fraction": "fraction",
    "left_out_fraction": "fraction",
    "size_ci95_mm": "mm",
    "similarity": "",
}

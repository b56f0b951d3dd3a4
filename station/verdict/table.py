"""The table of measures: all that a measure is, in one record."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Measure:
    """A measure of a page.

    unit: `fraction`, mm, ppi, px, or empty. worse: which values are worse. what: its name in the text of a check.
    form: how its value is printed. hint: what to do when it is not green. definition: what is measured.
    """

    name: str
    unit: str
    worse: Literal["less", "more"]
    what: str
    form: str
    hint: str
    definition: str


# Checks of one level stand in this order in records.
MEASURES: Mapping[str, Measure] = {
    one.name: one
    for one in (
        Measure(
            "measured_fraction",
            "fraction",
            "less",
            "covered",
            "{:.1%}",
            "turn the page to the light of the laser, or capture it again from another side",
            "part of the page that the scanner measured",
        ),
        Measure(
            "hole_mm",
            "mm",
            "more",
            "widest hole",
            "{:.1f} mm",
            "dark or glossy places give no range: capture again with more laser power",
            "width of the widest place without range data",
        ),
        Measure(
            "cropped_fraction",
            "fraction",
            "more",
            "cut off",
            "{:.1%} of the outline",
            "move the page into the image",
            "outline of the page at the edge of the image",
        ),
        Measure(
            "depth_window_fraction",
            "fraction",
            "more",
            "depth window",
            "{:.0%} of the way",
            "move the page to the middle of the scanner's range",
            "distance from the centre of the depth window (0) to its end (1)",
        ),
        Measure(
            "smooth_strain_rms",
            "fraction",
            "more",
            "strain",
            "{:.2%} rms",
            "the surface is not a single sheet: look for a finger, a weight, a leaf behind",
            "`strain.smooth_rms` of the report",
        ),
        Measure(
            "sampling_ppi",
            "ppi",
            "less",
            "resolution",
            "{:.0f} ppi",
            "go nearer, or take the lens of longer focal length",
            "pixels of the colour image for one inch of paper",
        ),
        Measure(
            "blur_px",
            "px",
            "more",
            "focus",
            "{:.1f} px",
            "focus again; did the page move?",
            "spread of the sharpest edges of the colour image",
        ),
        Measure(
            "clipped_fraction",
            "fraction",
            "more",
            "clipped",
            "{:.1%}",
            "change the exposure: light or gain",
            "full white or full black, before illumination correction",
        ),
        Measure(
            "left_out_fraction",
            "fraction",
            "more",
            "not restored",
            "{:.0%} of the page's size",
            "remove the other sheet, or restore both with planish restore --sheets separate",
            "size of the largest sheet in the image that is not restored, of the page's",
        ),
        Measure(
            "size_ci95_mm",
            "mm",
            "more",
            "size known to",
            "{:.2f} mm (95 %)",
            "calibrate the scanner with planish calibrate: the manual's figures hold for no body exactly",
            "half of the 95 % interval of the longer side",
        ),
        Measure(
            "similarity",
            "",
            "more",
            "same page",
            "{:.2f}",
            "it looks like a page that was captured already: did the leaf turn?",
            "correlation with other pages of the session",
        ),
    )
}

"""Scale of inputs without one.

They are photographs, and meshes whose unit is not known.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from math import sqrt

import numpy as np

from restore import BadInput, RangeScan, Settings, SurfaceMesh, restore
from restore.formats import rescale_mesh
from station.choices import Sheets
from station.errors import UsageError
from station.run.pieces import select_sheets

SIZE = re.compile(r"(?P<width>\d+(\.\d+)?)\s*[x×]\s*(?P<height>\d+(\.\d+)?)")
MEASURED = Settings(points=300, dpi=30)  # enough to measure the size of a page to a tenth of a millimetre
OTHER_SHAPE = 0.01  # of the ratio of the sides: a page is measured better than that, and a wrong size is not meant


@dataclass(frozen=True)
class Scale:
    """Where the scale of photographs comes from: card, size of the page in mm, or neither."""

    card: bool = True
    page_mm: tuple[float, float] | None = None

    @classmethod
    def parse(cls, text: str) -> Scale:
        """The scale that an option names. Raises UsageError for another text."""
        if text in ("card", "none"):
            return cls(card=text == "card")
        return cls(card=False, page_mm=_size(text, "give card, none, or the page's width × height: 210x297"))


def _size(text: str, hint: str) -> tuple[float, float]:
    """Width and height in mm. Raises UsageError for a text that is neither."""
    size = SIZE.fullmatch(text.strip().lower())
    if size is None or not min(float(size["width"]), float(size["height"])) > 0:
        raise UsageError(f"--scale: {text!r} is not a scale", hint)
    return float(size["width"]), float(size["height"])


def page_size_of(text: str) -> tuple[float, float]:
    """Return width and height in mm that --scale gives a mesh's page.

    Raises UsageError for another text.
    """
    return _size(text, "give the page's width × height in mm: 210x297")


def scaled_to(scan: RangeScan | SurfaceMesh, page_mm: tuple[float, float], pieces: Sheets) -> SurfaceMesh:
    """Return a mesh with its page as large as page_mm.

    page_mm is width × height in mm in either orientation.
    pieces: as of the run; of several pages it is the largest.
    Raises UsageError for a range image, which has a scale, BadInput when the sides of the page have another ratio,
    NotEnoughSurface without a page.
    """
    if not isinstance(scan, SurfaceMesh):
        raise UsageError("--scale: a range image has its own scale", "leave --scale out")
    extent = float(np.ptp(scan.vertices, axis=0).max())
    # To about its size first: sizes that no page has are refused, and limits in mm are in the code that measures.
    mesh = rescale_mesh(scan, max(page_mm) / extent if extent > 0.0 else 1.0)
    pages = select_sheets(mesh, pieces)
    page = max(pages, key=lambda one: one.sheet.size if one.sheet else 0.0)
    return rescale_mesh(mesh, factor_to(page.scan, page_mm))


def factor_to(page: SurfaceMesh | RangeScan, wanted: tuple[float, float]) -> float:
    """Return the factor that makes a page width × height mm in either orientation.

    Raises BadInput when its sides have another ratio.
    """
    width, height = restore(page, MEASURED).report["page_mm"]
    ratio, known = max(width, height) / min(width, height), max(wanted) / min(wanted)
    if abs(ratio / known - 1) > OTHER_SHAPE:
        raise BadInput(
            f"the page's sides are as {ratio:.3f} to 1, and those of {wanted[0]:g} × {wanted[1]:g} mm as {known:.3f}",
            "measure the page, and give its size with --scale, or leave --scale out",
        )
    return sqrt(wanted[0] * wanted[1] / (width * height))

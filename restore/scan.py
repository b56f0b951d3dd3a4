"""The data types from the scanner to the page.

Frame of every position: the scanner's. Origin at the lens, X right, Y up, the object at negative Z, millimetres.
Texture pixels: (x right, y down), the centre of the top left pixel is (0, 0).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from restore.findings import Finding

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]

Provenance = Mapping[str, Any]
"""Facts about a scan: JSON values."""
Part = Literal["", "left", "right"]
"""Which leaf of an opened book a sheet is; empty for any other."""


@dataclass(frozen=True, eq=False)
class RangeScan:
    """One shot of the scanner: a grid of surface points and the colour image.

    points      (rows, cols, 3) float64 mm, NaN where nothing was measured; row 0 is the top of the image.
    texture     (h, w, 3) uint8 RGB, or None for a scan without colour.
    texture_xy  (rows, cols, 2) float64, position of each sample in the texture, in pixels.
    provenance  facts about the shot: device, lens, distance_mm, mode, settings, time, … (JSON values only).
    findings    of its capture or its file, which go into the report of its page.

    >>> points = np.array([[[0.0, 0.0, -900.0], [np.nan, np.nan, np.nan]]])
    >>> RangeScan(points, None, np.zeros((1, 2, 2))).measured
    array([[ True, False]])
    """

    points: Floats
    texture: Bytes | None
    texture_xy: Floats
    provenance: Provenance = field(default_factory=dict)
    findings: tuple[Finding, ...] = field(default=(), kw_only=True)

    @property
    def measured(self) -> Mask:
        """Return where the scanner measured a point, (rows, cols) bool."""
        x, y, z = np.moveaxis(np.isfinite(self.points), 2, 0)  # `all` over so short an axis takes twenty times as long
        return np.asarray(x & y & z)


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """A triangle mesh of the warped page.

    vertices   (n, 3) float64 mm.
    faces      (m, 3) int64, counter-clockwise when viewed from the printed side.
    texcoords  (n, 2) float64 texture pixels, or None.
    texture    (h, w, 3) uint8 RGB, or None.
    findings   of its file, which go into the report of its page.

    >>> corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 0.0]])
    >>> SurfaceMesh(corners, np.array([[0, 1, 2], [0, 2, 3]])).faces.shape
    (2, 3)
    """

    vertices: Floats
    faces: Ints
    texcoords: Floats | None = None
    texture: Bytes | None = None
    provenance: Provenance = field(default_factory=dict)
    findings: tuple[Finding, ...] = field(default=(), kw_only=True)


Scan = TypeVar("Scan", bound=RangeScan | SurfaceMesh)


def with_findings(scan: Scan, *findings: Finding) -> Scan:
    """The scan with further findings."""
    return replace(scan, findings=scan.findings + findings) if findings else scan


@dataclass(frozen=True, eq=False)
class ScannedSheet(ABC):
    """One sheet of a scan, as `separate_sheets` finds it and `restore` takes it.

    scan              the scan without the other sheets.
    size              area of the sheet in the scan: mm² of a mesh, samples of a range image.
    part              `left` or `right` for a leaf of an opened book, empty for any other sheet.
    gutter_hidden_mm  of such a leaf, least width of paper at the spine that gave no range.
    """

    scan: RangeScan | SurfaceMesh
    size: float
    part: Part = field(default="", kw_only=True)
    gutter_hidden_mm: float = field(default=0.0, kw_only=True)

    @property
    @abstractmethod
    def is_rectangular(self) -> bool:
        """Return whether the flat sheet is a rectangle.

        It is a whole page, then, not a fragment of a torn one.
        """

    @property
    def area(self) -> Mask | None:
        """Return the sheet in a range image (rows, cols), None where not known."""
        return None


@dataclass(frozen=True, eq=False)
class InterpolatedMesh(SurfaceMesh):
    """A surface mesh through measured points, interpolated between them.

    measured  (k, 3) float64 mm: the points that were measured.
    reach_mm  of a measured point: farther from all of them, the surface counts as interpolated.
    """

    measured: Floats = field(default_factory=lambda: np.empty((0, 3)))
    reach_mm: float = np.inf

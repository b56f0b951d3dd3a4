"""The data types from the scanner to the page.

Frame of every position: the scanner's. Origin at the lens, X right, Y up, the object at negative Z, millimetres.
Texture pixels: (x right, y down), the centre of the top left pixel is (0, 0).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from restore.findings import Finding

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]


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
    provenance: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = field(default=(), kw_only=True)

    @property
    def measured(self) -> Mask:
        """(rows, cols) bool, True where the scanner measured a point."""
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
    """

    vertices: Floats
    faces: Ints
    texcoords: Floats | None = None
    texture: Bytes | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = field(default=(), kw_only=True)


Scan = TypeVar("Scan", RangeScan, SurfaceMesh)


def with_findings(scan: Scan, *findings: Finding) -> Scan:
    """The scan with further findings."""
    return replace(scan, findings=scan.findings + findings) if findings else scan


@dataclass(frozen=True, eq=False)
class InterpolatedMesh(SurfaceMesh):
    """A surface mesh through measured points, interpolated between them.

    measured  (k, 3) float64 mm: the points that were measured.
    reach_mm  of a measured point: farther from all of them, the surface counts as interpolated.
    """

    measured: Floats = field(default_factory=lambda: np.empty((0, 3)))
    reach_mm: float = np.inf


@dataclass(frozen=True, eq=False)
class FlatMesh(SurfaceMesh):
    """A surface mesh with its flat positions on the page.

    flat       (n, 2) float64 mm, x right, y up, never mirrored, upright as in the scanner's view.
    steps      iterations or time steps that the flattening took.
    lengths    (e,) float64 mm: rest lengths along the surface, in the order of `restore.mesh.network.edges_of`.
    residual   rms strain that a single vertex could still be relieved of when the solver stopped.
    converged  whether the solver reached its tolerance on every piece.
    """

    flat: Floats = field(default_factory=lambda: np.empty((0, 2)))
    steps: int = 0
    lengths: Floats = field(default_factory=lambda: np.empty(0))
    residual: float = 0.0
    converged: bool = True

    @property
    def convergence(self) -> dict[str, Any]:
        """`residual` and `converged` by their names."""
        return {"residual": self.residual, "converged": self.converged}

    @classmethod
    def of(cls, mesh: SurfaceMesh, flat: Floats, lengths: Floats, steps: int, **convergence: Any) -> Self:
        """A flat mesh from a surface mesh, its flat positions (n, 2) mm and its rest lengths (e,) mm.

        convergence: `residual` and `converged` of the solver.
        """
        surface: dict[str, Any] = {name: getattr(mesh, name) for name in SurfaceMesh.__dataclass_fields__}
        return cls(**surface, flat=flat, lengths=lengths, steps=steps, **convergence)


@dataclass(frozen=True, eq=False)
class RestoredPage:
    """The flat page, painted true to scale.

    image     (h, w, 3) uint8 RGB.
    dpi       one inch of paper is `dpi` pixels.
    mask      (h, w) bool, True where the camera saw the page, its shape measured or filled in.
    flat      the flattened mesh of the requested number of points.
    fine      the finer mesh that maps the picture to the page, the same when the scan has no grid.
    report    options, sizes, strain, findings and times (JSON values only).
    page_map  (h, w, 2) float32, the texture pixel that each page pixel came from, NaN outside the page.
    master    (h, w, 3) uint8 RGB, the page with its shading; equal to the image where shading is kept.
    coverage  (h, w) uint8, the kind of each pixel: values of `restore.texture.coverage.Seen`.
    page_source  (h, w) uint8, with photographs: the picture that page_map's pixel is in. 0 is the texture, k the k-th
                 photograph, 255 outside the page. None without photographs.
    findings  what is to be reported of the page; `report["findings"]` has the same as JSON values.
    """

    image: Bytes
    dpi: float
    mask: Mask
    flat: FlatMesh
    report: Mapping[str, Any]
    page_map: NDArray[np.float32]
    fine: FlatMesh
    master: Bytes
    coverage: Bytes
    page_source: NDArray[np.uint8] | None = None
    findings: tuple[Finding, ...] = ()

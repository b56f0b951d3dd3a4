"""A point cloud as its file holds it, and the limits of such files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.parsing.mesh import colours_from, provenance
from restore.formats.parsing.source import DAMAGED, ONE_SHOT
from restore.formats.parsing.unit import AUTO, in_millimetres
from restore.numerics.units import MAX_COORDINATE_MM, UNIT_MM
from restore.scan import Bytes, Floats, Mask, SurfaceMesh

MAX_POINTS = 2**23  # the largest structured-light cameras have 5 million pixels
MAX_BYTES = 2**29  # five million points as text, a hundred bytes each
SUBSET = 2**15  # points that decide signs and sizes
# Of bytes over those that they are compressed to: LZF reaches 88, coordinates of single precision 4. What is packed
# closer was made to fill the memory.
MAX_RATIO = 100

Size = tuple[int, int]
"""Columns and rows of a grid."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """Points in the order and the frame of their file.

    points     (n, 3) in the unit of the file, NaN where missing.
    colours    (n, 3) uint8 RGB, or None.
    size       of its grid, whose points are in raster order, top row first; None for a loose cloud.
    normals    (n, 3) towards the scanner, or None.
    viewpoint  (3,) of the scanner.
    axes       (3, 3), the scanner's, in rows.
    frame      `right-handed`: its columns may run to the left; `either`: the order of its columns and rows decides.
    picture    (h, w, 3) RGB with positions (n, 2) of the points in it, where it is not one colour for each point.
    """

    points: Floats
    colours: Bytes | None = None
    size: Size | None = None
    normals: Floats | None = None
    viewpoint: Floats = field(default_factory=lambda: np.zeros(3))
    axes: Floats = field(default_factory=lambda: np.eye(3))
    frame: str = "either"
    picture: tuple[Bytes, Floats] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()

    @property
    def measured(self) -> Mask:
        """Return which points are not missing, (n,)."""
        x, y, z = self.points.T
        return np.asarray(np.isfinite(x) & np.isfinite(y) & np.isfinite(z))


def cloud_of(
    path: Path,
    points: NDArray[Any],
    colours: NDArray[Any] | None = None,
    intensity: NDArray[Any] | None = None,
    **facts: Any,
) -> Cloud:
    """Return the cloud of arrays of a file, its missing points as NaN.

    Points that are not numbers are missing, and those at the origin, as devices write them.
    points: (n, 3). colours: (n, 3), as for `colours_from`. intensity: (n,) in any unit, a grey picture where colours
        are missing. facts: further fields of the cloud.
    Raises BadInput for too many points, or coordinates that cannot be.
    """
    check_count(path, len(points))
    with np.errstate(invalid="ignore"):  # of a NaN that signals
        places = np.array(points, np.float64)
    x, y, z = places.T
    missing = ~(np.isfinite(x) & np.isfinite(y) & np.isfinite(z)) | ((x == 0) & (y == 0) & (z == 0))
    if missing.all():
        raise BadInput(f"{path} holds no point that was measured", DAMAGED)
    places[missing] = np.nan
    with np.errstate(invalid="ignore"):
        far = np.abs(places).max(axis=1) > MAX_COORDINATE_MM * max(UNIT_MM.values())
    if far.any():
        first = int(np.argmax(far))
        x, y, z = places[first]
        raise BadInput(f"{path}: point {first} lies at ({x:g}, {y:g}, {z:g})", DAMAGED)
    if colours is None and intensity is not None:
        colours = np.repeat(_grey(intensity, ~missing)[:, None], 3, axis=1)
    found = None if colours is None else colours_from(colours)
    if found is not None and (found == found[0]).all():  # what programs write for want of colours
        found = None
    return Cloud(places, found, provenance={**provenance(path), "points": int((~missing).sum())}, **facts)


def check_count(path: Path, count: int) -> None:
    """Raise BadInput for a cloud without points or with more than are read."""
    if count < 1:
        raise BadInput(f"{path} holds no points", DAMAGED)
    if count > MAX_POINTS:
        raise BadInput(f"{path} has {count} points, more than {MAX_POINTS}", ONE_SHOT)


def scaled(path: Path, cloud: Cloud, unit: str = AUTO) -> Cloud:
    """Return the cloud in millimetres. Raises BadInput as `in_millimetres`."""
    measured = cloud.measured
    points = SurfaceMesh(cloud.points[measured], np.empty((0, 3), np.int64), provenance=cloud.provenance)
    mesh = in_millimetres(path, points, unit)
    factor = 1.0 if mesh is points else float(np.abs(mesh.vertices).max() / np.abs(points.vertices).max())
    return replace(
        cloud,
        points=cloud.points * factor,
        viewpoint=cloud.viewpoint * factor,
        provenance=mesh.provenance,
        findings=cloud.findings + mesh.findings,
    )


def _grey(intensity: NDArray[Any], measured: Mask) -> Bytes:
    """Return brightness (n,) of an intensity, scaled to what most points have."""
    values = np.nan_to_num(np.asarray(intensity, np.float64))
    low, high = np.percentile(values[measured], (1, 99))
    return np.asarray(np.clip((values - low) / max(high - low, np.finfo(float).tiny) * 255.0, 0, 255), np.uint8)

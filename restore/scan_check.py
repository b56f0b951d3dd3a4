"""Refuses scans that cannot be used, before any work.

Their arrays do not fit together, or their provenance cannot be read.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from restore.errors import BadInput
from restore.scan import Bytes, Floats, Mask, RangeScan, SurfaceMesh

HINT = "read the scan with load_scan, or give arrays as RangeScan and SurfaceMesh describe them"
FARTHEST_PX = 2.0**52  # farther off, double precision does not resolve a pixel
MAX_SUPER_FACTOR = 16  # shots on a grid of sixteenths of a pixel: finer than any registration
PROVENANCE_HINT = "give a dictionary of JSON values, as RangeScan describes it"


def refuse_unusable_image(scan: RangeScan) -> None:
    """Raise BadInput for a range image that cannot be used.

    For arrays of other shapes or types than RangeScan allows, for a picture that shows nothing of the scan, and for a
    provenance that cannot be read.
    """
    _check_source(scan)
    _check_grid(scan)


def refuse_unusable_mesh(mesh: SurfaceMesh) -> None:
    """Raise BadInput for a mesh that cannot be used, as `refuse_unusable_image` does.

    Its vertices and faces are checked where it is validated.
    """
    _check_source(mesh)
    for what in ("vertices", "faces"):
        if not np.ndim(getattr(mesh, what)):
            raise BadInput(f"the {what} of the mesh are not an array", HINT)
    if mesh.texcoords is not None:
        _check_texcoords(mesh.texcoords, mesh.texture)


def _check_source(scan: RangeScan | SurfaceMesh) -> None:
    check_provenance(scan.provenance)
    if scan.texture is not None:
        _check_picture(scan.texture)


def _check_picture(texture: Bytes) -> None:
    _check_array("a colour image", texture)
    if texture.dtype != np.uint8 or texture.ndim != 3 or texture.shape[2] != 3 or texture.size == 0:
        raise BadInput(f"a colour image {_described(texture)} is not an image: (h, w, 3) of uint8 is one", HINT)


def _check_grid(scan: RangeScan) -> None:
    points, places = scan.points, scan.texture_xy
    _check_array("points", points)
    _check_array("texture_xy", places)
    if points.ndim != 3 or points.shape[2] != 3 or points.dtype.kind != "f":
        raise BadInput(f"points {_described(points)} are not a range grid: (rows, cols, 3) of floats is one", HINT)
    if places.shape != (*points.shape[:2], 2) or places.dtype.kind != "f":
        shapes = f"texture_xy {_described(places)} does not fit points {_described(points)}"
        raise BadInput(f"{shapes}: (rows, cols, 2) of floats does", HINT)
    if scan.texture is not None and scan.measured.any() and not (_seen(places, scan.texture) & scan.measured).any():
        raise BadInput("no sample of the scan lies in its colour image", HINT)


def _check_texcoords(texcoords: Floats, texture: Bytes | None) -> None:
    _check_array("texture coordinates", texcoords)
    if texcoords.dtype.kind not in "fiu":
        raise BadInput(f"texture coordinates {_described(texcoords)} are not numbers", HINT)
    if not (np.abs(texcoords) < FARTHEST_PX).all():
        raise BadInput("some vertices have texture coordinates that are not finite, or beyond every image", HINT)
    fits = texcoords.ndim == 2 and texcoords.shape[1] == 2 and len(texcoords)  # others are refused in validation
    if texture is not None and fits and not _seen(texcoords, texture).any():
        raise BadInput("no vertex of the mesh lies in its colour image", HINT)


def _check_array(what: str, array: Any) -> None:
    if not isinstance(array, np.ndarray):
        raise BadInput(f"{what}: {type(array).__name__!r} is not an array", HINT)


def _seen(places: Floats, texture: Bytes) -> Mask:
    """Return which texture pixels (..., 2) are in a picture (h, w, 3), (...) bool."""
    height, width = texture.shape[:2]
    x, y = places[..., 0], places[..., 1]
    seen: Mask = (x >= -0.5) & (x <= width - 0.5) & (y >= -0.5) & (y <= height - 0.5)
    return seen


def _described(array: Any) -> str:
    return f"{array.shape} of {array.dtype}"


class SuperRecord(BaseModel):
    """Record of super-resolution of a colour image: its pixels per camera pixel, one side."""

    factor: int = Field(default=1, ge=1, le=MAX_SUPER_FACTOR)


class AxisRecord(BaseModel):
    """Record of the axis of the turntable: a point on it, mm, and its direction."""

    model_config = ConfigDict(allow_inf_nan=False)
    point_mm: tuple[float, float, float]
    direction: tuple[float, float, float]

    @field_validator("direction")
    @classmethod
    def _has_length(cls, direction: tuple[float, float, float]) -> tuple[float, float, float]:
        if not any(direction):
            raise ValueError("direction has no length")
        return direction


class TurnRecord(BaseModel):
    """Record of the stage's angle, degrees, and of its axis."""

    model_config = ConfigDict(allow_inf_nan=False)
    deg: float
    axis: AxisRecord | None = None


class KnownProvenance(BaseModel):
    """What of the provenance of a scan is read.

    oversampling  pixels of a picture that was painted, per pixel or vertex that it was painted from, along one side.
    """

    super_resolution: SuperRecord = SuperRecord()
    oversampling: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)
    turntable: TurnRecord | None = None


def check_provenance(provenance: Any) -> None:
    """Raise BadInput for the provenance of a scan that cannot be read."""
    if not isinstance(provenance, Mapping):
        raise BadInput(
            f"the provenance of the scan is not a dictionary but {type(provenance).__name__!r}", PROVENANCE_HINT
        )
    try:
        KnownProvenance.model_validate(dict(provenance))
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(["provenance", *map(str, fault["loc"])])
        raise BadInput(f"{where} of the scan cannot be used: {fault['msg']}", PROVENANCE_HINT) from error

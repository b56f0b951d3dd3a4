"""The facts about a scan that the restoration reads; the rest of its provenance is free."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from restore.errors import BadInput

MAX_SUPER_FACTOR = 16  # shots on a grid of sixteenths of a pixel: finer than any registration
HINT = "give a dictionary of JSON values, as RangeScan describes it"


class SuperRecord(BaseModel):
    """Record of the super-resolution of a colour image: its pixels per pixel of the camera, along one side."""

    factor: int = Field(default=1, ge=1, le=MAX_SUPER_FACTOR)


class AxisRecord(BaseModel):
    """Record of the axis of the rotary stage: a point on it, mm, and its direction."""

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

    super: SuperRecord = SuperRecord()
    oversampling: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)
    turn: TurnRecord | None = None


def check_provenance(provenance: Any) -> None:
    """Raise BadInput for the provenance of a scan that cannot be read."""
    if not isinstance(provenance, Mapping):
        raise BadInput(f"the provenance of the scan is no dictionary but {type(provenance).__name__!r}", HINT)
    try:
        KnownProvenance.model_validate(dict(provenance))
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(["provenance", *map(str, fault["loc"])])
        raise BadInput(f"{where} of the scan cannot be used: {fault['msg']}", HINT) from error

"""The options of a restoration, the same for the library and the command line."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

Method = Literal["isometric", "sticks", "springs", "conformal", "applicable"]
MIN_POINTS = 50  # a page of fewer has no interior points


class Settings(BaseModel):
    """How to restore a page.

    >>> Settings(dpi=300).points
    1000
    >>> Settings(points=10)  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
        ...
    ValidationError: 10 points are too few
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    points: int = Field(1000, ge=0, le=400_000, description="points that the sheet is reduced to, 0 for all")
    dpi: float = Field(150.0, ge=30, le=1200, description="pixels of the page for one inch of paper")
    method: Method = Field("isometric", description="how the sheet is flattened")
    shading: Literal["keep", "remove"] = Field("keep", description="keep or remove light and shadow")
    white_balance: Literal["keep", "paper"] = Field(
        "keep", description="keep the colour of the light, or make bare paper neutral"
    )
    inpaint_mm: float = Field(0.0, ge=0, le=50, description="occluded places up to this width are inpainted")

    uncertainty: bool = Field(False, description="estimate how far places on the page may be off")

    @field_validator("points")
    @classmethod
    def _are_enough(cls, points: int) -> int:
        if 0 < points < MIN_POINTS:
            raise ValueError(f"{points} points are too few: give 0 for all, or {MIN_POINTS} and more")
        return points

"""Limits of the verdict's measures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict

Limits = tuple[float, float]
Level = Literal["green", "amber", "red"]
LEVELS: tuple[Level, ...] = ("green", "amber", "red")
WORSE: Mapping[str, Literal["less", "more"]] = {
    "measured_fraction": "less",
    "hole_mm": "more",
    "cropped_fraction": "more",
    "depth_window_fraction": "more",
    "smooth_strain_rms": "more",
    "sampling_ppi": "less",
    "blur_px": "more",
    "clipped_fraction": "more",
    "left_out_fraction": "more",
    "size_ci95_mm": "more",
    "similarity": "more",
}
"""The direction in which each measure is worse."""


class Thresholds(BaseModel):
    """Limits of each check, amber and red; None: not checked.

    Any order is read, as of a session that has such limits: where the first is the greater one, less is worse.
    `check_limits` refuses the order that no measure has.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    measured_fraction: Limits | None = None
    hole_mm: Limits | None = None
    cropped_fraction: Limits | None = None
    depth_window_fraction: Limits | None = None
    smooth_strain_rms: Limits | None = None
    sampling_ppi: Limits | None = None
    blur_px: Limits | None = None
    clipped_fraction: Limits | None = None
    left_out_fraction: Limits | None = None
    size_ci95_mm: Limits | None = None
    similarity: Limits | None = None


def check_limits(name: str, limits: Limits | None) -> None:
    """Raise ValueError for limits in the wrong order.

    The order says the opposite of the direction in which the measure is worse.

    >>> check_limits("blur_px", (2.0, 1.2))
    Traceback (most recent call last):
    ValueError: [2.0, 1.2] are in the wrong order: more is worse, so the first must not be the greater one
    """
    if limits is None:
        return
    falling = limits[0] > limits[1]
    if falling != (WORSE[name] == "less"):
        needed = "must not" if falling else "must"
        raise ValueError(
            f"{list(limits)} are in the wrong order: {WORSE[name]} is worse, so the first {needed} be the greater one"
        )

"""Limits of the verdict's measures."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, create_model

from station.verdict.table import MEASURES

Limits = tuple[float, float]
Level = Literal["green", "amber", "red"]
LEVELS: tuple[Level, ...] = ("green", "amber", "red")


class Limited(BaseModel):
    """Limits of each check, amber and red; None: not checked.

    Any order is read, as of a session that has such limits: where the first is the greater one, less is worse.
    `check_limits` refuses the order that no measure has.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    def of(self, name: str) -> Limits | None:
        """Return the limits of a measure."""
        found: Limits | None = getattr(self, name)
        return found


_limits: Any = dict.fromkeys(MEASURES, (Limits | None, None))
Thresholds = create_model("Thresholds", __base__=Limited, **_limits)


def check_limits(name: str, limits: Limits | None) -> None:
    """Raise ValueError for limits in the wrong order.

    The order says the opposite of the direction in which the measure is worse.

    >>> check_limits("blur_px", (2.0, 1.2))
    Traceback (most recent call last):
    ValueError: [2.0, 1.2] are in the wrong order: more is worse, so the first must not be the greater one
    """
    if limits is None:
        return
    falling, worse = limits[0] > limits[1], MEASURES[name].worse
    if falling != (worse == "less"):
        needed = "must not" if falling else "must"
        raise ValueError(
            f"{list(limits)} are in the wrong order: {worse} is worse, so the first {needed} be the greater one"
        )

"""The settings of a capture by a Vivid 900."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, Self

from drivers.scanner import CaptureSettings, setting

MIN_DISTANCE_MM, MAX_DISTANCE_MM = 500.0, 2500.0  # hardware manual p. 56, and the error "out of distance range"
MAX_LASER_POWER = 255
MAX_GAIN = 7


@dataclass(frozen=True, kw_only=True)
class VividSettings(CaptureSettings):
    """Settings of one capture by a Vivid 900.

    mode         "fine": 640×480 samples in 2.5 s; "fast": 320×240 samples in 0.3 s.
    distance_mm  distance from the front of the lens to the page; None uses autofocus.
    laser_power  None lets the scanner choose.
    gain         CCD gain; None lets the scanner choose.
    multi_depth  take further shots focused nearer and farther where the page exceeds the depth window.

    >>> VividSettings(distance_mm=900).mode
    'fine'
    >>> VividSettings(distance_mm=90)
    Traceback (most recent call last):
        ...
    drivers.scanner.SettingsError: distance_mm = 90 is out of range
    """

    mode: Literal["fine", "fast"] = setting("fine", "640 × 480 samples in 2.5 s, or 320 × 240 in 0.3 s")
    distance_mm: float | None = setting(
        None, "lens to page; empty: autofocus", unit="mm", low=MIN_DISTANCE_MM, high=MAX_DISTANCE_MM
    )
    laser_power: int | None = setting(None, "empty: the scanner chooses", low=1, high=MAX_LASER_POWER)
    gain: int | None = setting(None, "gain of the sensor; empty: the scanner chooses", low=0, high=MAX_GAIN)
    multi_depth: bool = setting(False, "further captures where the page exceeds the depth window")

    def preview(self) -> Self:
        """One FAST shot with the focus and exposure of a capture."""
        return replace(self, mode="fast", average=1, multi_depth=False)


def settings_of(_config: Mapping[str, Any]) -> type[VividSettings]:
    """The class of settings of a `[scanner]` table."""
    return VividSettings

"""Turn the leaves of a simulated volume: which opening is before the scanner."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from drivers.simulated.config import OpeningConfig, SceneConfig
from drivers.simulated.imaging.colour import BLUR_PX
from drivers.simulated.imaging.sensor import ChangingSensor
from drivers.vivid900.capture.camera import Vivid900

DEFOCUSED_PX = 3.0  # of the colour image: far beyond the limit of every preset


class Presented(NamedTuple):
    """A scene before the scanner. seed: of its noise. blur_px: of the lens."""

    scene: SceneConfig
    seed: int = 0
    blur_px: float = BLUR_PX


def presented(book: Sequence[OpeningConfig], opening: int, attempt: int) -> Presented:
    """What a capture of an opening shows, which was captured `attempt` times before.

    After the last opening nothing is turned.
    """
    opening = min(opening, len(book) - 1)
    first_shot = "good" if attempt else book[opening].first_shot
    seed = opening + attempt * len(book)
    if first_shot == "not turned" and opening:
        return Presented(book[opening - 1], seed)
    return Presented(book[opening], seed, DEFOCUSED_PX if first_shot == "out of focus" else BLUR_PX)


class LeavesSensor(ChangingSensor):
    """The sensor of a body before a volume, opened at its first leaf.

    look  gives the sensor before one scene.
    """

    def __init__(self, book: Sequence[OpeningConfig], look: Callable[[Presented], ChangingSensor]) -> None:
        self._book, self._look = tuple(book), look
        self._show(0, 0)

    def turn_to(self, opening: int, attempt: int) -> None:
        """See Turner."""
        if (opening, attempt) != self._lies:
            self._show(opening, attempt)

    @property
    def _now(self) -> ChangingSensor:
        return self._shown

    def _show(self, opening: int, attempt: int) -> None:
        self._shown = self._look(presented(self._book, opening, attempt))
        self._lies = opening, attempt
        self.distance_mm, self.contrast = self._now.distance_mm, self._now.contrast


class BookScanner(Vivid900):
    """A scanner before a volume whose leaves it turns.

    leaves  the sensor that sees them.
    """

    leaves: LeavesSensor

    def turn_to(self, opening: int, attempt: int) -> None:
        """See Turner."""
        self.leaves.turn_to(opening, attempt)

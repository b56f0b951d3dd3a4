"""Illumination of a simulated scene: lamps near or far, and ambient light."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

from restore.scan import Floats

Colour = tuple[float, float, float]
NEUTRAL = (1.0, 1.0, 1.0)
FAR_MM = 1e9  # effectively infinite
LAMP_POINTS = 12  # a lamp of some size is as many points: its half-shadow has steps of 8 %
GOLDEN = np.pi * (3 - 5**0.5)  # turns a spiral so that its points cover a disc evenly (Vogel 1979)


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Lamp:
    """Lamp at `at_mm` (x, y, z) in the scanner's frame.

    share: fraction of the light on paper that faces the scanner in the centre of the image.
    radius_mm: of a disc that faces the page; 0 for a point, whose shadows are sharp.
    """

    at_mm: tuple[float, float, float]
    share: Annotated[float, Field(ge=0, le=4)] = 0.55
    colour: Colour = NEUTRAL
    radius_mm: Annotated[float, Field(ge=0, le=1000)] = 0.0

    def points(self) -> Floats:
        """Return the points (k, 3) mm that stand for the lamp."""
        if self.radius_mm == 0:
            return np.array([self.at_mm])
        k = np.arange(LAMP_POINTS)
        reach, turn = self.radius_mm * np.sqrt((k + 0.5) / LAMP_POINTS), GOLDEN * k
        disc = np.stack([reach * np.cos(turn), reach * np.sin(turn), np.zeros(LAMP_POINTS)], axis=1)
        return np.asarray(disc + self.at_mm)


# From the upper left, the usual side for a desk lamp.
DESK_LAMP = Lamp(at_mm=(-0.5 * FAR_MM, 0.45 * FAR_MM, 0.75 * FAR_MM))


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Light:
    """All light on the scene.

    ambient: fraction of the light that comes from all sides; with those of the lamps it makes 1 on white paper that is
        exposed to code 226.
    lean: gradient of the ambient light: how much more falls on surfaces that face right, and up, than on level ones.
    shadows: whether the scene casts shadows and occludes ambient light.
    """

    lamps: tuple[Lamp, ...] = (DESK_LAMP,)
    ambient: Annotated[float, Field(ge=0, le=4)] = 0.45
    ambient_colour: Colour = NEUTRAL
    lean: tuple[float, float] = (0.0, 0.0)
    shadows: bool = False

    @property
    def level(self) -> Floats:
        """Return the light (3,) on unobstructed paper facing the scanner, in the image's centre."""
        lamps = [lamp.share * np.array(lamp.colour) for lamp in self.lamps]
        return np.asarray(sum(lamps, self.ambient * np.array(self.ambient_colour)))


DESK_LIGHT = Light()

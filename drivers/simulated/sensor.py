"""What the CCD of the simulated scanner adds up in a shot of the scene before it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from drivers.simulated.colour import photograph
from drivers.simulated.exposing import exposure_of
from drivers.simulated.facemaps import FaceMaps
from drivers.simulated.optics import MOST_SIGNAL, Sighting, expose, look
from drivers.simulated.raycast import RayCaster
from drivers.simulated.scene import Scene
from drivers.simulated.shot import Truth
from drivers.vivid900.calibration import Calibration
from drivers.vivid900.lenses import Mode
from drivers.vivid900.pitch import Sums
from restore.scan import Bytes, Floats

MAX_LEVEL = 1023  # of the ten-bit converter; MOST_SIGNAL lies there
# A stripe is as bright as its brightest frame over about this many frames.
STRIPE_FRAMES = 3.0
HAND = 0  # the stream of random numbers that are the hand's; shots are counted from one


@dataclass(frozen=True)
class Place:
    """How far a scene was turned by a rotary stage, in degrees, and then moved by a hand, right and up."""

    turned_deg: float = 0.0
    moved_mm: tuple[float, float] = (0.0, 0.0)


class Hand:
    """Whoever moves the page a little while the laser is off: so far at most, right or left and up or down."""

    def __init__(self, reach_mm: float, *, seed: int) -> None:
        self.moved_mm, self._reach_mm = (0.0, 0.0), reach_mm
        self._rng = np.random.default_rng([seed, HAND])

    def touch(self) -> None:
        """Lay the page somewhere else."""
        x, y = self._rng.uniform(-self._reach_mm, self._reach_mm, 2)
        self.moved_mm = float(x), float(y)


class Sensor(Protocol):
    """What the device has before it.

    distance_mm  where autofocus finds the page, from the front of the lens.
    contrast     whether there is anything on it that focusing by contrast can hold on to.
    """

    distance_mm: float
    contrast: bool

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """The sums of a shot focused at a distance. The same shot number gives the same noise."""
        ...

    def colour(self, shot: int) -> Bytes:
        """(480, 640, 3) uint8 RGB."""
        ...


def add_up(pitch: Floats, signal: Floats) -> Sums:
    """The sums of samples whose stripe crossed at pitch (rows, cols), NaN where it was lost, at a signal of 1 for
    white paper well exposed.

    The samples' noise is in the pitch already; here it is only rounded, to a few thousandths of a frame on paper.
    """
    level = np.clip(signal * (MAX_LEVEL / MOST_SIGNAL), 0, MAX_LEVEL)
    seen = np.isfinite(pitch)
    total = np.where(seen, np.maximum(np.rint(level * STRIPE_FRAMES), 1), 0)
    moment = np.rint(np.nan_to_num(pitch) * total)
    # What was lost leaves no light, except where there was too much of it.
    intensity = np.where(seen | (level == MAX_LEVEL), level / 4, 0)
    return Sums(total.astype(np.uint32), moment.astype(np.uint32), intensity.astype(np.uint8))


class SceneSensor:
    """A scene seen by a body. Shots differ in their noise and repeat with the seed."""

    def __init__(self, scene: Scene, body: Calibration, distance_mm: float, *, seed: int, contrast: bool) -> None:
        self.distance_mm, self.contrast = distance_mm, contrast
        self._scene, self._body, self._seed = scene, body, seed
        self._caster, self._maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
        # Two modes at two distances: a preview is followed by shots of the same. 25 MB each.
        self._look: Callable[[Mode, float], Sighting] = lru_cache(maxsize=4)(self._sighting)

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        sighting, exposure = self._look(mode, distance_mm), exposure_of(distance_mm, power, gain)
        pitch = expose(sighting, self._body, mode, distance_mm, self._noise(shot, 0), exposure)
        return add_up(pitch, sighting.signal * exposure)

    def colour(self, shot: int) -> Bytes:
        """See Sensor."""
        return photograph(self._scene, self._caster, self._maps, self._body, self._noise(shot, 1))

    def truth(self, mode: Mode) -> Truth:
        """The truth about every shot of a mode."""
        sighting, scene = self._look(mode, self.distance_mm), self._scene
        return Truth(scene.printed.page_mm, scene.printed, sighting.flat, sighting.points, scene.surface)

    def _sighting(self, mode: Mode, distance_mm: float) -> Sighting:
        body = self._body
        return look(self._scene, self._caster, self._maps, body, mode, distance_mm + body.pupil_mm)

    def _noise(self, shot: int, exposure: int) -> np.random.Generator:
        return np.random.default_rng([self._seed, shot, exposure])


class MovedSensor:
    """A scene that a rotary stage or a hand moves, seen as it lies when it is looked at.

    at     the sensor of the scene in a place.
    place  tells where it lies.
    """

    def __init__(self, at: Callable[[Place], SceneSensor], place: Callable[[], Place]) -> None:
        self._at, self._place = lru_cache(maxsize=1)(at), place
        self.distance_mm, self.contrast = self._now.distance_mm, self._now.contrast

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        return self._now.sweep(mode, distance_mm, power, gain, shot)

    def colour(self, shot: int) -> Bytes:
        """See Sensor."""
        return self._now.colour(shot)

    def truth(self, mode: Mode) -> Truth:
        """The truth about a shot taken now."""
        return self._now.truth(mode)

    @property
    def _now(self) -> SceneSensor:
        return self._at(self._place())

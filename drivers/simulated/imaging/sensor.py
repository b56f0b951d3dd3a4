"""The simulated range sensor: accumulated sums and colour image of a capture of the scene."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np

from drivers.simulated.imaging.colour import BLUR_PX, photograph
from drivers.simulated.imaging.exposure import relative_exposure
from drivers.simulated.imaging.facemaps import FaceMaps
from drivers.simulated.imaging.optics import SATURATION_SIGNAL, RayHits, measure_pitch, trace_rays
from drivers.simulated.imaging.raycast import RayCaster
from drivers.simulated.imaging.shot import Truth
from drivers.simulated.scene.scene import Scene
from drivers.vivid900.capture.pitch import Sums
from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import Mode
from restore.scan import Bytes, Floats

MAX_LEVEL = 1023  # of the ten-bit converter; SATURATION_SIGNAL lies there
# A stripe is as bright as its brightest frame over about this many frames.
STRIPE_FRAMES = 3.0
NUDGE_STREAM = 0  # random stream of the page's displacements; shots are counted from one


@dataclass(frozen=True)
class Displacement:
    """Displacement of a scene: turntable rotation, degrees, then a shift right and up, mm."""

    turned_deg: float = 0.0
    moved_mm: tuple[float, float] = (0.0, 0.0)


class PageNudge:
    """Random displacement of the page between captures, uniform up to a reach."""

    def __init__(self, reach_mm: float, *, seed: int) -> None:
        self.moved_mm, self._reach_mm = (0.0, 0.0), reach_mm
        self._rng = np.random.default_rng([seed, NUDGE_STREAM])

    def nudge(self) -> None:
        """Draw a new displacement."""
        x, y = self._rng.uniform(-self._reach_mm, self._reach_mm, 2)
        self.moved_mm = float(x), float(y)


class Sensor(Protocol):
    """The sensor of the device.

    distance_mm  where autofocus finds the page, from the front of the lens.
    contrast     whether the page has enough contrast for passive autofocus.
    """

    distance_mm: float
    contrast: bool

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """Return the sums of a capture focused at a distance.

        The same capture number gives the same noise.
        """
        ...

    def colour(self, shot: int) -> Bytes:
        """Return the colour image, (480, 640, 3) uint8 RGB."""
        ...


def quantise(pitch: Floats, signal: Floats) -> Sums:
    """Return the sums of samples.

    The pitch contains the noise already; here it is only rounded, to a few thousandths of a frame on paper.
    pitch: (rows, cols), where the stripe crossed, NaN where it was lost.
    signal: 1 for white paper well exposed.
    """
    level = np.clip(signal * (MAX_LEVEL / SATURATION_SIGNAL), 0, MAX_LEVEL)
    seen = np.isfinite(pitch)
    total = np.where(seen, np.maximum(np.rint(level * STRIPE_FRAMES), 1), 0)
    moment = np.rint(np.nan_to_num(pitch) * total)
    # A lost sample has no light, unless it was saturated.
    intensity = np.where(seen | (level == MAX_LEVEL), level / 4, 0)
    return Sums(total.astype(np.uint32), moment.astype(np.uint32), intensity.astype(np.uint8))


class SceneSensor:
    """Sensor of a body looking at a scene.

    Noise differs between captures and repeats with the seed.
    """

    def __init__(
        self,
        scene: Scene,
        body: Calibration,
        distance_mm: float,
        *,
        seed: int,
        contrast: bool,
        blur_px: float = BLUR_PX,
    ) -> None:
        self.distance_mm, self.contrast = distance_mm, contrast
        self._scene, self._body, self._seed, self._blur_px = scene, body, seed, blur_px
        self._caster, self._maps = RayCaster(scene.vertices, scene.faces), FaceMaps.of(scene)
        # Two modes at two distances: a preview is followed by shots of the same. 25 MB each.
        self._traced: Callable[[Mode, float], RayHits] = lru_cache(maxsize=4)(self._trace)

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        hits, exposure = self._traced(mode, distance_mm), relative_exposure(distance_mm, power, gain)
        pitch = measure_pitch(hits, self._body, mode, distance_mm, self._noise(shot, 0), exposure)
        return quantise(pitch, hits.signal * exposure)

    def colour(self, shot: int) -> Bytes:
        """See Sensor."""
        noise = self._noise(shot, 1)
        return photograph(self._scene, self._caster, self._maps, self._body, noise, blur_px=self._blur_px)

    def truth(self, mode: Mode) -> Truth:
        """Ground truth of every shot of a mode."""
        hits, scene = self._traced(mode, self.distance_mm), self._scene
        return Truth(scene.printed.page_mm, scene.printed, hits.flat, hits.points, scene.surface)

    def _trace(self, mode: Mode, distance_mm: float) -> RayHits:
        body = self._body
        return trace_rays(self._scene, self._caster, self._maps, body, mode, distance_mm + body.pupil_mm)

    def _noise(self, shot: int, exposure: int) -> np.random.Generator:
        return np.random.default_rng([self._seed, shot, exposure])


class ChangingSensor(ABC):
    """The sensor of a scene that changes between shots."""

    distance_mm: float
    contrast: bool

    def sweep(self, mode: Mode, distance_mm: float, power: int, gain: int, shot: int) -> Sums:
        """See Sensor."""
        return self._now.sweep(mode, distance_mm, power, gain, shot)

    def colour(self, shot: int) -> Bytes:
        """See Sensor."""
        return self._now.colour(shot)

    def truth(self, mode: Mode) -> Truth:
        """Ground truth of a shot taken now."""
        return self._now.truth(mode)

    @property
    @abstractmethod
    def _now(self) -> SceneSensor | ChangingSensor:
        """The sensor of what is there now."""


class MovedSensor(ChangingSensor):
    """The sensor of a scene that is displaced between shots.

    at     gives the sensor of the scene at a displacement.
    place  gives the present displacement.
    """

    def __init__(self, at: Callable[[Displacement], SceneSensor], place: Callable[[], Displacement]) -> None:
        self._at, self._place = lru_cache(maxsize=1)(at), place
        self.distance_mm, self.contrast = self._now.distance_mm, self._now.contrast

    @property
    def _now(self) -> SceneSensor:
        return self._at(self._place())

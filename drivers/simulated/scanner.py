"""The simulated scanner behind the same door as the real one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from types import TracebackType
from typing import Any, Self

import numpy as np

from drivers.scanner import MAX_GAIN, MAX_LASER_POWER, CaptureSettings, Progress, TransportError
from drivers.simulated import config as settings_table
from drivers.simulated.scene import Scene, lay
from drivers.simulated.shot import Truth, printed, shoot_scene
from drivers.vivid900.lenses import LENSES, MODES, REFERENCE_MM, Lens
from restore.scan import Floats, RangeScan

PAPER_POWER = 30.0  # laser power for white paper at REFERENCE_MM; operators report 23 for a bright plate
GAIN_STEP = 2**0.5  # brightness from one CCD gain to the next; the manual names the steps, not their size


def _utc() -> datetime:
    return datetime.now(UTC)


def _silent(step: str, done: float) -> None:
    """No one is listening."""


class SimulatedScanner:
    """A Vivid 900 before which a page lies. Shots differ in their noise and repeat with the seed.

    truth  the truth about the last shot, None before the first.
    """

    def __init__(
        self,
        scene: Scene,
        lens: Lens,
        distance_mm: float,
        seed: int,
        now: Callable[[], datetime] = _utc,
        *,
        nudge_px: float = 0.0,
    ) -> None:
        self._nudge_mm = nudge_px * (distance_mm + lens.pupil_mm) / lens.focal_px
        self.truth: Truth | None = None
        self._scene, self._lens, self._distance_mm, self._seed, self._now = scene, lens, distance_mm, seed, now
        self._shots, self._open = 0, True

    def capture(self, settings: CaptureSettings, progress: Progress = _silent) -> RangeScan:
        """Shoot once. Raises TransportError after `close`."""
        if not self._open:
            raise TransportError("the scanner is closed", "open it again")
        distance = self._distance_mm if settings.distance_mm is None else settings.distance_mm
        progress("focus", 1.0)
        exposure, power, gain = expose_for_paper(distance, settings)
        rng = np.random.default_rng([self._seed, self._shots])
        noted = {
            "seed": self._seed,
            "shot": self._shots,
            "laser_power": power,
            "gain": gain,
            "time": self._now().isoformat(),
        }
        progress("scan", 0.0)
        scan, self.truth = shoot_scene(
            self._scene.moved(self._nudge()),
            self._lens,
            MODES[settings.mode],
            distance,
            rng,
            exposure=exposure,
            provenance=noted,
        )
        progress("scan", 1.0)
        self._shots += 1
        return scan

    def _nudge(self) -> Floats:
        """(3,) mm; of its own generator, so that the noise of a shot does not depend on it."""
        reach = self._nudge_mm if self._shots else 0.0
        across, up = np.random.default_rng([self._seed, self._shots, 1]).uniform(-reach, reach, 2)
        return np.array([across, up, 0.0])

    def close(self) -> None:
        """Let the scanner go. Safe to call twice."""
        self._open = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def expose_for_paper(distance_mm: float, settings: CaptureSettings) -> tuple[float, int, int]:
    """Exposure against what white paper needs at a distance, and the laser power and gain that give it.

    What the settings leave open is chosen: power first, and gain once the laser can do no more.
    """
    needed = PAPER_POWER * (distance_mm / REFERENCE_MM) ** 2
    power = min(max(round(needed), 1), MAX_LASER_POWER) if settings.laser_power is None else settings.laser_power
    lacking = round(float(np.log(needed / power) / np.log(GAIN_STEP)))
    gain = min(max(lacking, 0), MAX_GAIN) if settings.gain is None else settings.gain
    return power * GAIN_STEP**gain / needed, power, gain


def connect(config: Mapping[str, Any], now: Callable[[], datetime] = _utc) -> SimulatedScanner:
    """The simulated scanner that the `[scanner]` table of a station configuration describes.

    now  clock for the time noted with each scan.
    Raises SettingsError when a setting is not known or not possible.
    """
    wanted = settings_table.read(config)
    sheet, artwork = wanted.scene.build()
    lens = LENSES[wanted.lens]
    scene = lay(
        sheet,
        printed(artwork, wanted.scene.page_mm),
        depth_mm=wanted.distance_mm + lens.pupil_mm,
        pose=wanted.scene.pose,
        table=wanted.scene.table,
        gap_mm=wanted.scene.gap_mm,
        light=wanted.scene.light,
    )
    return SimulatedScanner(scene, lens, wanted.distance_mm, wanted.seed, now, nudge_px=wanted.nudge_px)

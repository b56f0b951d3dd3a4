"""A Vivid 900 as a Scanner: the call order of the vendor's kit over any transport.

parameters → autofocus → write → release → pitch → colour; afterwards, and after every error, the laser is switched off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from typing import Any, Literal, TypeVar

import numpy as np

from drivers.safety.device_context import DeviceContext
from drivers.safety.parking import run_parked
from drivers.scanner import LASER_MAY_BE_ON, Progress, ScannerError, TransportError
from drivers.scsi.commands import Identity
from drivers.scsi.errors import BadReply
from drivers.vivid900.capture import merge
from drivers.vivid900.capture.body import RANGE_MODES, SHOT_S, Body, Shot
from drivers.vivid900.capture.colour import Samples
from drivers.vivid900.capture.shot_parameters import choose_parameters
from drivers.vivid900.errors import Interrupted, NothingMeasured
from drivers.vivid900.geometry.calibration import Calibration
from drivers.vivid900.geometry.lenses import LENSES, MODES, texture_grid
from drivers.vivid900.geometry.triangulation import points_of
from drivers.vivid900.link import Link
from drivers.vivid900.profile.commands import Parameters, ShotMode, State, Status
from drivers.vivid900.profile.profile import Profile
from drivers.vivid900.settings import VividSettings
from restore.scan import Bytes, Floats, RangeScan

# Parking waits for the end of a shot, 5 s at most; a parameter block takes milliseconds.
PARK_S, PARK_COMMAND_S = 12.0, 3.0
CAPTURE_S = 120.0  # deadline: a FINE shot takes 5 s, three attempts with their longest waits about a minute
ATTEMPTS = 3  # a capture that failed by a reset or a damaged block is repeated twice
Result = TypeVar("Result")
CalibrationOf = Callable[[Status], Calibration]


def _utc() -> datetime:
    return datetime.now(UTC)


def _silent(step: str, done: float) -> None:
    """Progress callback that does nothing."""


def _nothing() -> None:
    """No work: only parking."""


class Vivid900(DeviceContext):
    """A Vivid 900. Raising from `progress` cancels a capture at any point.

    identity  its INQUIRY data.
    """

    close_failure = "and the scanner could not be brought to rest"

    def __init__(
        self,
        link: Link,
        profile: Profile,
        calibration_of: CalibrationOf,
        *,
        park: Sequence[Callable[[], object]] = (),
        now: Callable[[], datetime] = _utc,
    ) -> None:
        """Identify the scanner and switch its laser off.

        Its transport is closed when that fails.
        calibration_of  gives the calibration for the mounted lens.
        park            further actions that make the set-up safe after every capture, failed or not.
        Raises ProfileMismatch before any command of the profile is sent to a scanner that it is not for.
        """
        self._link, self._profile, self._calibration_of = link, profile, calibration_of
        self._park, self._now, self._open = tuple(park), now, True
        try:
            self.identity: Identity = link.identify()
            profile.require(self.identity)
            profile.require_trust("a write to the scanner")
            self._link = replace(link, profile=profile)
            self._link.clear_attentions()
            run_parked(_nothing, [self._laser_off])
        except BaseException:
            link.transport.close()
            raise

    @property
    def state(self) -> State | Literal["off"]:
        """State of the scanner; "off" when it does not answer."""
        try:
            self._link.clear_attentions()
            return self._body().status().state
        except ScannerError:
            return "off"

    def capture(self, settings: VividSettings, progress: Progress = _silent) -> RangeScan:
        """Focus, take the shots and return the range grid with its colour image.

        Returns points (rows, cols, 3) mm with texture (480, 640, 3) uint8 RGB. Raises SettingsError, DeviceError or
        TransportError; the laser is off then as well.
        """
        return self._attempt(lambda body: self._capture(body, settings), progress, capture_limit_s(settings))

    def preview(self, settings: VividSettings, progress: Progress = _silent) -> RangeScan:
        """One FAST shot with the focus and exposure that `capture` would choose."""
        return self.capture(settings.preview(), progress)

    def photograph(self, mode: ShotMode = ShotMode.COLOUR_8, progress: Progress = _silent) -> Samples:
        """A colour image without a range image and without laser. Raises as `capture` does.

        Returns (480, 640, 3) uint8 RGB, uint16 up to 1023 in ten bits, or (480, 640, 1) of a single channel.
        """
        if mode.has_range:
            raise ValueError(f"{mode.name} is not a colour-only mode")
        return self._attempt(lambda body: _photograph(body, mode), progress, CAPTURE_S)

    def close(self) -> None:
        """Switch the laser off and close the connection. Safe to call twice."""
        if not self._open:
            return
        self._open = False
        run_parked(_nothing, [self._laser_off, *self._park, self._link.transport.close])

    def _body(self, progress: Progress = _silent) -> Body:
        return Body(self._link, self._profile, progress)

    def _laser_off(self) -> None:
        """Switch the laser off within PARK_S. An error has the note that the laser may be on."""
        link = self._link.within(PARK_S, command_s=PARK_COMMAND_S)
        try:
            Body(link, self._profile, _silent).laser_off()
        except BaseException as error:
            error.add_note(LASER_MAY_BE_ON)
            raise

    def _attempt(self, work: Callable[[Body], Result], progress: Progress, limit_s: float) -> Result:
        """Do the work, retry after a reset or damaged block, always park.

        limit_s  deadline of all attempts together, seconds.
        """
        if not self._open:
            raise TransportError("the scanner is closed", "open it again")
        link = self._link.within(limit_s)
        body = Body(link, self._profile, _with_deadline(progress, link))
        for _ in range(ATTEMPTS - 1):
            with suppress(Interrupted, BadReply):
                return self._once(work, body)
        return self._once(work, body)

    def _once(self, work: Callable[[Body], Result], body: Body) -> Result:
        def attempt() -> Result:
            body.link.clear_attentions()
            return work(body)

        return run_parked(attempt, [self._laser_off, *self._park])

    def _capture(self, body: Body, settings: VividSettings) -> RangeScan:
        status = body.wait_ready()
        calibration = self._calibration_of(status)
        parameters = choose_parameters(body, settings, calibration)
        mode, lens, textures = MODES[settings.mode], LENSES[calibration.lens], list[Bytes | None]()

        def shoot(distance_mm: int) -> Floats:
            here = replace(parameters, distance_mm=distance_mm)
            frames, colours = _average([body.shoot(here) for _ in range(settings.average)], here.mode)
            textures.append(colours)
            return points_of(frames, calibration, mode, distance_mm)

        body.progress("scan", 0.0)
        first = parameters.distance_mm
        shots = merge.cover_depths(shoot, first, lens, mode) if settings.multi_depth else [(first, shoot(first))]
        body.progress("scan", 1.0)
        points = merge.merge_depths(shots, calibration, mode)
        if not np.isfinite(points[..., 2]).any():
            raise NothingMeasured("the scanner measured nothing", "check distance_mm, laser_power and the page's place")
        noted = self._provenance(settings, parameters, status, calibration, [distance for distance, _ in shots])
        return RangeScan(points, textures[0], texture_grid(mode), noted)

    def _provenance(
        self,
        settings: VividSettings,
        parameters: Parameters,
        status: Status,
        calibration: Calibration,
        distances: list[int],
    ) -> dict[str, Any]:
        return {
            "device": str(self.identity),
            "profile": self._profile.name,
            "body": status.body_serial,
            "lens": calibration.lens,
            "lens_serial": status.lens_serial,
            "calibration": calibration.as_json(),
            "mode": settings.mode,
            "distance_mm": parameters.distance_mm,
            "distances_mm": distances,
            "laser_power": parameters.laser_power,
            "gain": parameters.gain,
            "average": settings.average,
            "integrity": self._profile.integrity,
            "unchecked": [text for text in self._profile.absences.values() if text.startswith("no check")],
            "time": self._now().isoformat(),
        }


def capture_limit_s(settings: VividSettings) -> float:
    """Return the deadline of a capture, seconds.

    It is the settings', or CAPTURE_S, or twice the time of many shots.
    """
    if settings.deadline_s is not None:
        return settings.deadline_s
    shots = settings.average * (merge.MAX_DEPTHS if settings.multi_depth else 1)
    return max(CAPTURE_S, 2 * shots * SHOT_S[0])


def _with_deadline(progress: Progress, link: Link) -> Progress:
    """Report the elapsed fraction of the deadline with each step."""
    start, name = link.clock(), f"at most {link.limit_s:g} s"

    def report(step: str, done: float) -> None:
        progress(step, done)
        progress(name, min((link.clock() - start) / link.limit_s, 1.0))

    return report


def _average(shots: Sequence[Shot], mode: ShotMode) -> tuple[Floats, Bytes | None]:
    """Average shots of the same scene.

    Returns the mean pitch (rows, cols) and the mean colour (480, 640, 3) uint8, None without colour.
    """
    pitches = [shot.pitch.frames for shot in shots if shot.pitch is not None]
    colours = [shot.colour.pixels for shot in shots if shot.colour is not None]
    frames = merge.average(pitches, RANGE_MODES[mode])
    if len(colours) > 1:
        return frames, np.rint(np.mean(colours, axis=0)).astype(np.uint8)
    return frames, colours[0].astype(np.uint8) if colours else None


def _photograph(body: Body, mode: ShotMode) -> Samples:
    body.wait_ready()
    shot = body.shoot(replace(body.read_parameters(), mode=mode, laser_power=0))
    assert shot.colour is not None  # a colour-only mode always has one
    return shot.colour.pixels

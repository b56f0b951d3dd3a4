"""Opens the real driver over a simulated device, as the station does."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from drivers.scanner import SettingsError
from drivers.scsi.in_process import InProcess
from drivers.simulated import config as settings_table
from drivers.simulated.book import BookScanner, LeavesSensor, Presented
from drivers.simulated.config import ScannerConfig
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.simulated.device.stage import PtyStage, machine
from drivers.simulated.imaging.sensor import ChangingSensor, Displacement, MovedSensor, PageNudge, SceneSensor
from drivers.simulated.imaging.shot import printed
from drivers.simulated.scene.scene import place_sheet
from drivers.stage import RotaryStage, controller_named, open_port
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.geometry.calibration import Calibration, nominal, read_calibration
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.link import Link
from drivers.vivid900.profile.profile import Profile, load_profile

LENS_SERIALS = {"TELE": 9000125, "MIDDLE": 9000114, "WIDE": 9000108}
BLANK = {"white"}  # artwork without contrast for passive autofocus


def _utc() -> datetime:
    return datetime.now(UTC)


@dataclass(frozen=True, eq=False)
class Rig:
    """A simulated device, its clock, and the scene sensor behind its lens."""

    device: SimulatedDevice
    clock: VirtualClock
    sensor: ChangingSensor


def _still() -> float:
    return 0.0


def rig(
    config: Mapping[str, Any], *, clock: Callable[[], float] | None = None, angle: Callable[[], float] = _still
) -> Rig:
    """Return the device that a `[scanner]` table describes, without a driver above it.

    clock: the device's time; a virtual one by default.
    angle: gives the position of the turntable, degrees.
    Raises SettingsError when a setting is not known or not possible.
    """
    wanted = settings_table.read(config)
    virtual, body = VirtualClock(), _body(wanted)
    pixel_mm = (wanted.distance_mm + body.pupil_mm) / body.focal_px
    page_nudge = PageNudge(wanted.nudge_px * pixel_mm, seed=wanted.seed)
    look = partial(_sensor, wanted, body, lambda: Displacement(angle(), page_nudge.moved_mm))
    sensor = LeavesSensor(wanted.book, look) if wanted.book else look(Presented(wanted.scene))
    lens = Lens(wanted.lens, LENS_SERIALS[wanted.lens], sensor)
    device = SimulatedDevice(lens, load_profile(wanted.profile), clock or virtual, parked=page_nudge.nudge)
    return Rig(device, virtual, sensor)


def _sensor(
    wanted: ScannerConfig, body: Calibration, place: Callable[[], Displacement], shown: Presented
) -> MovedSensor:
    seen = shown.scene
    sheet, artwork = seen.build()
    scene = place_sheet(
        sheet,
        printed(artwork, seen.page_mm),
        depth_mm=wanted.distance_mm + body.pupil_mm,
        pose=seen.pose,
        table=seen.table,
        gap_mm=seen.gap_mm,
        light=seen.light,
    )
    look: dict[str, Any] = {"contrast": artwork.name not in BLANK, "blur_px": shown.blur_px}

    def at(place: Displacement) -> SceneSensor:
        moved = scene.turned(place.turned_deg, seen.axle) if place.turned_deg else scene
        moved = moved.moved(np.array([*place.moved_mm, 0.0])) if any(place.moved_mm) else moved
        return SceneSensor(moved, body, wanted.distance_mm, seed=wanted.seed + shown.seed, **look)

    return MovedSensor(at, place)


def _body(wanted: ScannerConfig) -> Calibration:
    """The true geometry of the simulated body."""
    if wanted.body is None:
        return nominal(LENSES[wanted.lens])
    body = read_calibration(Path(wanted.body))
    if body.lens != wanted.lens:
        raise SettingsError(f"scanner.body: {wanted.body} is of the lens {body.lens}", f"set lens = {body.lens!r}")
    return body


def connect(config: Mapping[str, Any], now: Callable[[], datetime] = _utc) -> Vivid900:
    """Open the scanner of a `[scanner]` table; with a book, a Turner.

    now  clock for the time noted with each scan.
    Raises SettingsError when a setting is not known or not possible.
    """
    return _open_camera(rig(config), config, now)


def open_link(config: Mapping[str, Any]) -> tuple[Link, Profile]:
    """The link to that scanner's device, and the profile that both speak."""
    setup = rig(config)
    return _link(setup), setup.device.profile


@contextmanager
def connect_turntable(
    config: Mapping[str, Any], model: str, *, relative: bool = False, now: Callable[[], datetime] = _utc
) -> Iterator[tuple[Vivid900, RotaryStage]]:
    """That scanner, and a simulated turntable that turns the scene in front of it.

    model, relative  as in `open_stage`; the simulated controller is of that model and counts in that way.
    Raises SettingsError for an unknown model as well.
    """
    controller = controller_named(model, relative=relative)
    clock, config = VirtualClock(), {**config, "nudge_px": 0.0}
    with PtyStage(machine(model, relative=relative), clock=clock) as fake:
        setup = replace(rig(config, clock=clock, angle=lambda: fake.angle_deg), clock=clock)
        port = open_port(fake.port, controller)
        stage = RotaryStage(port, controller, relative=relative, clock=clock, sleep=fake.sleep)
        with stage, _open_camera(setup, config, now) as scanner:
            yield scanner, stage


def _open_camera(setup: Rig, config: Mapping[str, Any], now: Callable[[], datetime]) -> Vivid900:
    calibration = config.get("calibration")
    known = calibrations(None if calibration is None else Path(calibration), lens=setup.device.lens.name)
    parts = _link(setup), setup.device.profile, known
    if not isinstance(setup.sensor, LeavesSensor):
        return Vivid900(*parts, now=now)
    scanner = BookScanner(*parts, now=now)
    scanner.leaves = setup.sensor
    return scanner


def _link(setup: Rig) -> Link:
    return Link(InProcess(setup.device), None, setup.clock, setup.clock.sleep)

"""Any order of an operator's actions: no bad state, and a scan as soon as all faults are cleared."""

from __future__ import annotations

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from drivers.scanner import DeviceError, ScannerError, TransportError
from drivers.scsi.in_process import InProcess
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.device import Lens, SimulatedDevice
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.geometry.lenses import LENSES
from drivers.vivid900.link import Link
from drivers.vivid900.profile.commands import ShotMode
from drivers.vivid900.profile.profile import SIMULATED, load_profile
from drivers.vivid900.settings import VividSettings
from oracles.simulation.device_faults import FaultyDevice
from oracles.simulation.plate import PlateSensor

PROFILE = load_profile(SIMULATED).model_copy(update={"chunk_bytes": 1 << 20})
SETTINGS = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=0)
LENS_NAMES = st.sampled_from(sorted(LENSES))
TRUE_MM = 0.02  # what rounding of the sums leaves of the plate's depth through the widest lens
LONGEST_BEAM_S = 2.5  # a FINE sweep: then the laser is out whatever became of the driver


class Cancelled(Exception):
    """What the operator's thread raises."""


def mounted(name: str) -> Lens:
    return Lens(name, 1, PlateSensor(lens=name))


class Operator(RuleBasedStateMachine):
    """One scanner, one cable, one driver at a time."""

    @initialize()
    def set_up(self) -> None:
        self.clock = VirtualClock()
        self.device = SimulatedDevice(mounted("MIDDLE"), PROFILE, self.clock)
        self.faulty = FaultyDevice(self.device)
        self.camera: Vivid900 | None = None
        self.powered = True

    def is_ready(self) -> bool:
        return self.faulty.connected and self.powered and not self.device.barrier

    @rule()
    def connect(self) -> None:
        link = Link(InProcess(self.faulty), None, self.clock, self.clock.sleep)
        try:
            self.camera = Vivid900(link, PROFILE, calibrations(None))
        except TransportError:
            assert not (self.faulty.connected and self.powered)

    @precondition(lambda self: self.camera)
    @rule(preview=st.booleans(), focus=st.booleans())
    def capture(self, preview: bool, focus: bool) -> None:
        wanted = VividSettings(mode="fast") if focus else SETTINGS
        try:
            scan = self.camera.preview(wanted) if preview else self.camera.capture(wanted)
        except ScannerError as error:
            assert not self.is_ready(), error
            assert error.hint
            return
        assert self.is_ready()
        lens = self.device.lens
        depth = lens.sensor.place_mm(self.device.shot) + LENSES[lens.name].pupil_mm
        assert scan.provenance["lens"] == lens.name
        assert np.abs(scan.points[..., 2] + depth).max() < TRUE_MM

    @precondition(lambda self: self.camera)
    @rule()
    def photograph(self) -> None:
        try:
            assert self.camera.photograph(ShotMode.MONITOR).shape == (480, 640, 1)
        except ScannerError:
            assert not self.is_ready()

    @precondition(lambda self: self.camera)
    @rule(after=st.integers(0, 12))
    def cancel(self, after: int) -> None:
        calls = [0]

        def progress(_step: str, _done: float) -> None:
            calls[0] += 1
            if calls[0] > after:
                raise Cancelled

        try:
            self.camera.capture(SETTINGS, progress)
        except Cancelled:
            assert self.is_parked() or not self.is_ready()
        except ScannerError:
            assert not self.is_ready()

    @rule()
    def unplug(self) -> None:
        self.faulty.connected = False

    @rule()
    def replug(self) -> None:
        self.faulty.connected = True

    @rule()
    def power_off(self) -> None:
        self.device.power_off()
        self.powered = False

    @rule()
    def power_on(self) -> None:
        self.device.power_off()
        self.device.power_on()
        self.powered = True

    @rule(name=LENS_NAMES)
    def change_lens(self, name: str) -> None:
        self.device.change_lens(mounted(name))

    @rule(closed=st.booleans())
    def move_barrier(self, closed: bool) -> None:
        self.device.barrier = closed

    @rule()
    def reset_bus(self) -> None:
        self.device.reset()

    @rule(panel=st.sampled_from(sorted(PROFILE.panels)))
    def trouble(self, panel: str) -> None:
        """Every message of the panel is reported once and then cleared."""
        if self.camera and self.is_ready() and self.device.state in ("ready", "data"):
            self.device.fails = panel
            try:
                self.camera.photograph()
            except DeviceError as error:
                assert panel in str(error)
            else:
                raise AssertionError(panel)

    @rule(seconds=st.floats(0.1, 20))
    def wait(self, seconds: float) -> None:
        self.clock.sleep(seconds)

    @precondition(lambda self: self.camera)
    @rule()
    def close(self) -> None:
        try:
            self.camera.close()
        except TransportError:
            assert not self.is_ready()
        self.camera = None

    def is_parked(self) -> bool:
        return self.device.is_parked

    @invariant()
    def the_laser_is_off(self) -> None:
        """At once when the driver could say so, at the end of the sweep when the cable was out."""
        log = self.device.log
        assert not log.laser_is_on or not self.is_ready()
        assert all(beam.end - beam.start <= LONGEST_BEAM_S for beam in log.beams)

    def teardown(self) -> None:
        """With all faults cleared, it scans."""
        self.replug()
        self.device.barrier = False
        if not self.powered:
            self.power_on()
        self.connect()
        self.capture(preview=False, focus=True)
        assert self.is_parked()


TestOperator = Operator.TestCase
TestOperator.settings = settings(
    max_examples=50, stateful_step_count=30, deadline=None, suppress_health_check=list(HealthCheck)
)

"""The camera over a device that answers bytes: order, states, focus, exposure, averages, depths, rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from drivers import SettingsError
from drivers.scanner import DeviceError, TransportError
from drivers.scsi.commands import STANDARD
from drivers.scsi.sense import Key
from drivers.simulated.device.device import SELF_TEST_S, Lens
from drivers.vivid900.capture.exposure import GAIN_STEP
from drivers.vivid900.errors import BarrierClosed, NotReady, PanelError, ProfileMismatch
from drivers.vivid900.faults import PANELS
from drivers.vivid900.profile.commands import ShotMode, build_parameters
from drivers.vivid900.settings import VividSettings
from oracles.simulation.plate import PlateSensor

FAST = VividSettings(mode="fast")
SET = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=0)
TAIL = bytes(range(1, 9))
PITCH_MM = 0.002  # the plate at 900 mm through sums of some 770: half a count is 0.0007 frames of 3.4 mm


def depth(scan) -> float:
    return float(np.nanmean(-scan.points[..., 2]))


def test_the_order_is_that_of_the_vendors_kit(camera, stand) -> None:
    stand.device.log.events.clear()
    camera.capture(replace(SET, laser_power=None))
    kinds = [event.what for event in stand.device.log.events]
    steps = [what for what in kinds if what not in ("command", "status", "parameters")]
    assert steps == ["autofocus", "release", "release"]  # the first is the preview
    commands = [event.detail for event in stand.device.log.named("command")]
    order = [name for name in dict.fromkeys(commands) if name not in ("status", "00 00 00 00 00 00")]
    assert order == ["read_parameters", "active_autofocus", "write_parameters", "release", "read_pitch", "read_colour"]


def test_a_plate_is_measured_where_it_stands(camera, stand) -> None:
    scan = camera.capture(SET)
    assert scan.points.shape == (240, 320, 3)
    assert scan.measured.all()
    assert depth(scan) == pytest.approx(stand.sensor.place_mm(stand.device.shot) + 21.5, abs=PITCH_MM)
    assert scan.texture.shape == (480, 640, 3)


def test_a_fine_shot_has_a_sample_for_every_pixel(camera) -> None:
    assert camera.capture(replace(SET, mode="fine")).points.shape == (480, 640, 3)


@pytest.mark.parametrize("distance", [620.0, 900.0, 1400.0])
def test_focus_and_exposure_are_found(make_stand, distance: float) -> None:
    stand = make_stand(sensor=PlateSensor(distance))
    with stand.camera() as camera:
        scan = camera.capture(FAST)
    assert scan.measured.all()
    assert scan.provenance["distance_mm"] == pytest.approx(distance, abs=3)
    assert scan.provenance["laser_power"] == pytest.approx(min(30 * (distance / 600) ** 2, 255), rel=0.05)


def test_a_laser_that_autofocus_set_too_strong_is_turned_down(make_stand) -> None:
    @dataclass(frozen=True)
    class Bright(PlateSensor):
        def sweep(self, mode, distance_mm, power, gain, shot):
            return super().sweep(mode, distance_mm, min(power * 10, 255 * 9), gain, shot)

    stand = make_stand(sensor=Bright())
    with stand.camera() as camera:
        scan = camera.capture(FAST)
    assert scan.measured.all()
    assert 6.8 / GAIN_STEP < scan.provenance["laser_power"] < 6.8 * GAIN_STEP


def test_without_contrast_the_laser_finds_the_distance(make_stand) -> None:
    stand = make_stand(sensor=PlateSensor(contrast=False))
    with stand.camera() as camera:
        scan = camera.capture(replace(SET, distance_mm=None))
    assert [event.detail for event in stand.device.log.named("command")].count("active_autofocus") == 1
    assert scan.provenance["distance_mm"] == 900
    assert scan.provenance["laser_power"] == 68


def test_a_page_too_near_is_reported(make_stand) -> None:
    stand = make_stand(sensor=PlateSensor(400.0))
    with stand.camera() as camera, pytest.raises(PanelError, match="nearer than"):
        camera.capture(FAST)
    assert stand.device.is_parked


def test_shots_are_averaged(camera, stand) -> None:
    before = stand.device.shot
    scan = camera.capture(replace(SET, average=5))
    assert stand.device.shot == before + 5
    places = [stand.sensor.place_mm(shot) for shot in range(before + 1, before + 6)]
    assert depth(scan) == pytest.approx(np.mean(places) + 21.5, abs=2 * PITCH_MM)


def test_colour_alone_needs_no_laser(camera, stand) -> None:
    beams = len(stand.device.log.beams)
    images = {mode: camera.photograph(mode) for mode in ShotMode if not mode.has_range}
    assert len(stand.device.log.beams) == beams
    assert images[ShotMode.COLOUR_8].shape == (480, 640, 3)
    assert images[ShotMode.MONITOR].shape == (480, 640, 1)
    assert images[ShotMode.COLOUR_10].max() > 255
    with pytest.raises(ValueError, match="FINE"):
        camera.photograph(ShotMode.FINE_COLOUR)


def test_it_waits_for_the_self_test(stand) -> None:
    stand.device.power_on()
    start = stand.clock()
    with stand.camera() as camera:
        assert camera.state == "warming-up"
        assert camera.capture(SET).measured.all()
    assert stand.clock() - start > SELF_TEST_S


def test_a_self_test_without_end_is_reported(stand) -> None:
    stand.device.power_on()
    stand.device._ready_at = float("inf")
    with pytest.raises(NotReady), stand.camera() as camera:
        camera.capture(SET)


def test_states(camera, stand) -> None:
    assert camera.state == "ready"
    stand.device.barrier = True
    assert camera.state == "barrier-closed"
    with pytest.raises(BarrierClosed, match="barrier") as refused:
        camera.capture(FAST)
    assert "take the barrier off" in refused.value.hint
    stand.device.barrier = False
    camera.capture(SET)
    stand.device.power_off()
    assert camera.state == "off"
    stand.device.power_on()
    assert camera.state == "warming-up"
    stand.clock.sleep(SELF_TEST_S)
    assert camera.state == "ready"


def test_a_power_cycle_between_captures_is_taken_notice_of(camera, stand) -> None:
    camera.capture(SET)
    stand.device.power_off()
    stand.device.power_on()
    assert camera.capture(SET).measured.all()


def test_another_lens_is_measured_with_its_own_geometry(camera, stand) -> None:
    camera.capture(SET)
    stand.device.change_lens(Lens("WIDE", 8, PlateSensor(lens="WIDE")))
    scan = camera.capture(SET)
    assert scan.provenance["lens"] == "WIDE"
    assert depth(scan) == pytest.approx(stand.sensor.place_mm(stand.device.shot) + 13.7, abs=2 * PITCH_MM)


@pytest.mark.parametrize("panel", sorted(PANELS))
def test_every_message_of_the_manual_is_reported_with_what_to_do(camera, stand, panel: str) -> None:
    stand.device.fails = panel
    with pytest.raises(DeviceError) as caught:
        camera.capture(SET)
    assert panel in str(caught.value)
    assert caught.value.hint
    assert camera.capture(SET).measured.all()


def commands_of(stand, capture) -> list[str]:
    first = len(list(stand.device.log.named("command")))
    capture()
    return [event.detail for event in stand.device.log.named("command")][first:]


class Stop(BaseException):
    """Whatever ends a capture from outside."""


@pytest.mark.parametrize("kind", [KeyboardInterrupt, Stop])
def test_cancelled_at_any_command_it_comes_to_rest(stand, kind: type[BaseException]) -> None:
    camera, settings = stand.camera(), FAST
    count = len(commands_of(stand, lambda: camera.capture(settings)))
    for step in range(count):

        def stop(faulty, call):
            faulty.no_fault(call)
            raise kind("now")

        stand.faulty.set_script({step: stop})
        stand.parked.clear()
        with pytest.raises(kind):
            camera.capture(settings)
        # The last commands are those of coming to rest; whoever stops these as well closes the camera next.
        assert stand.parked == ["stage"] or step >= count - 2
        if not stand.device.is_parked:
            assert step >= count - 2
        stand.faulty.set_script({})
        assert camera.capture(settings).measured.all()
    camera.close()
    assert stand.device.is_parked


def test_raising_from_progress_cancels(camera, stand) -> None:
    reported: list[str] = []

    def progress(step: str, done: float) -> None:
        reported.append(step)
        if step == "scan" and reported.count("scan") > 3:
            raise Stop

    with pytest.raises(Stop):
        camera.capture(SET, progress)
    assert stand.device.is_parked
    assert stand.device.state != "busy"


def test_every_other_thing_comes_to_rest_when_one_fails(stand) -> None:
    def jams() -> None:
        raise DeviceError("the stage is jammed")

    camera = stand.camera(park=(jams, lambda: stand.parked.append("lamp")))
    with pytest.raises(DeviceError, match="jammed"):
        camera.capture(SET)
    assert stand.parked == ["lamp"]
    assert stand.device.is_parked
    stand.device.fails = "LIGHT IMPROPER"
    with pytest.raises(PanelError, match="LIGHT") as caught:
        camera.capture(SET)
    assert "jammed" in caught.value.__notes__[0]


@pytest.fixture(scope="module")
def with_tail(large_chunks):
    """The profile with a longer parameter block: its last bytes have no field."""
    block = large_chunks.blocks.parameters.model_copy(update={"length": 16 + len(TAIL)})
    blocks = large_chunks.blocks.model_copy(update={"parameters": block})
    return large_chunks.model_copy(update={"blocks": blocks})


def test_bytes_without_a_field_travel_untouched(make_stand, with_tail) -> None:
    stand = make_stand(profile=with_tail)
    zeros = build_parameters(with_tail, stand.device.parameters)[: -len(TAIL)] + TAIL
    stand.device.parameter_block = build_parameters(with_tail, stand.device.parameters, base=zeros)
    with stand.camera() as camera:
        assert camera.capture(FAST).measured.all()
        camera.photograph()
    assert stand.device.is_parked
    assert stand.device.parameter_block[-len(TAIL) :] == TAIL


def test_parking_changes_the_laser_power_alone(stand) -> None:
    camera = stand.camera()
    camera.capture(SET)
    stand.device.parameters = replace(stand.device.parameters, laser_power=200, distance_mm=1234, gain=3)
    before = stand.device.parameters
    camera.close()
    assert stand.device.parameters == replace(before, laser_power=0)


def test_a_closed_camera_shoots_no_more(stand) -> None:
    camera = stand.camera()
    camera.close()
    camera.close()
    with pytest.raises(TransportError, match="closed"):
        camera.capture(SET)


def test_power_left_on_by_a_killed_driver_is_taken_back_on_connecting(stand) -> None:
    body = stand.camera()._body()
    body.set_parameters(replace(body.read_parameters(), laser_power=200))
    assert not stand.device.is_parked
    stand.camera()
    assert stand.device.is_parked


def test_a_driver_killed_in_the_middle_of_a_shot_leaves_a_laser_that_goes_out(stand) -> None:
    body = stand.camera()._body()
    body.set_parameters(replace(body.read_parameters(), laser_power=200, mode=ShotMode.FINE_COLOUR))
    stand.faulty.execute(bytes.fromhex("c3 00 00 00 00 00 00 00 00 00"), b"", 0)
    assert stand.device.log.laser_is_on
    stand.camera()
    assert stand.device.is_parked


def test_a_scanner_that_the_profile_is_not_for_gets_standard_commands_only(make_stand, large_chunks) -> None:
    other = large_chunks.firmware.model_copy(update={"product": "VIVID 900", "revisions": ("1.0",)})
    stand = make_stand(profile=large_chunks.model_copy(update={"firmware": other}))
    seen: list[bytes] = []
    execute = stand.faulty.execute
    stand.faulty.execute = lambda cdb, *rest: seen.append(cdb) or execute(cdb, *rest)
    stand.profile = large_chunks
    with pytest.raises(ProfileMismatch, match="SIM VIVID"):
        stand.camera()
    assert {cdb[0] for cdb in seen} <= STANDARD


def test_a_device_that_refuses_a_parameter_is_the_callers_fault(camera, stand) -> None:
    from oracles.simulation.device_faults import sense

    stand.faulty.set_script({3: sense(Key.ILLEGAL_REQUEST, 0x26)})
    with pytest.raises(SettingsError, match="parameter"):
        camera.capture(SET)


def test_deep_pages_are_shot_at_several_depths(make_stand) -> None:
    stand = make_stand(sensor=Slope())
    with stand.camera() as camera:
        one = camera.capture(SET)
        deep = camera.capture(replace(SET, multi_depth=True))
    assert one.measured.mean() < 0.6
    assert deep.measured.mean() > 0.99
    assert len(deep.provenance["distances_mm"]) >= 3
    exact = -Slope().depth(240, 320)
    assert np.nanmax(np.abs(deep.points[..., 2] - exact)) < 3 * PITCH_MM


@dataclass(frozen=True)
class Slope(PlateSensor):
    """A plate that stands 180 mm deeper at its left than at its right."""

    def depth(self, rows: int, cols: int) -> np.ndarray:
        return np.broadcast_to(np.linspace(1010.0, 830.0, cols), (rows, cols))

    def sweep(self, mode, distance_mm, power, gain, shot):
        from drivers.simulated.imaging.sensor import quantise
        from drivers.vivid900.geometry.calibration import nominal
        from drivers.vivid900.geometry.lenses import LENSES
        from drivers.vivid900.geometry.triangulation import in_window, pitch_at

        body = nominal(LENSES["MIDDLE"])
        pitch = pitch_at(body.baseline_mm / self.depth(mode.rows, mode.cols), body, mode, distance_mm)
        return quantise(np.where(in_window(pitch, body, mode), pitch, np.nan), np.ones(pitch.shape))

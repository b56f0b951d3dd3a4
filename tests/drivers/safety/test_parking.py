"""Parking after work: every action runs, no error is lost, and no number of signals interrupts it."""

from __future__ import annotations

import resource
import signal
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from drivers.safety import parking
from drivers.safety.parking import run_parked
from drivers.safety.signals import ENDING_SIGNALS, SignalGuard
from drivers.scanner import LASER_MAY_BE_ON, DeviceError, TransportError
from drivers.scsi.replay import Recorder
from drivers.vivid900.capture import camera as camera_module
from drivers.vivid900.capture.camera import PARK_COMMAND_S, PARK_S, Vivid900
from drivers.vivid900.connecting import calibrations
from drivers.vivid900.errors import HardwareFault
from drivers.vivid900.profile.commands import ShotMode
from drivers.vivid900.settings import VividSettings
from oracles.ways_out import Ended, ending_handlers

SET = VividSettings(mode="fast", distance_mm=900, laser_power=68, gain=0)
FOLLOWING_LINES = 40  # of the program after the end of the work: beyond the last of parking
INTERRUPTIONS = [*((signal.SIGINT, times) for times in range(1, 6)), (signal.SIGTERM, 3), (signal.SIGHUP, 5)]


@pytest.fixture(autouse=True)
def handlers():
    """Every ending signal raises, as at the station; the test run's own handlers come back."""
    with ending_handlers() as end:
        yield
        for number in ENDING_SIGNALS:
            assert signal.getsignal(number) is end


def test_all_actions_run_in_order_after_any_failure() -> None:
    done: list[str] = []

    def jam() -> None:
        done.append("stage")
        raise DeviceError("jammed")

    with pytest.raises(DeviceError, match="jammed"):
        run_parked(lambda: done.append("work"), [lambda: done.append("laser"), jam, lambda: done.append("lamp")])
    assert done == ["work", "laser", "stage", "lamp"]

    def stopped() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        run_parked(stopped, [jam])
    assert caught.value.__notes__ == ["and the scanner could not be brought to rest: jammed"]


def test_a_foreign_error_of_one_action_does_not_stop_the_others() -> None:
    done: list[str] = []

    def full() -> None:
        raise OSError(28, "No space left on device")

    with pytest.raises(OSError, match="No space"):
        run_parked(lambda: None, [full, lambda: done.append("stage")])
    assert done == ["stage"]


@pytest.mark.parametrize(("number", "times"), INTERRUPTIONS)
def test_signals_during_a_shot_and_after_it_leave_the_laser_off(stand, number: int, times: int) -> None:
    camera = stand.camera()
    stand.faulty.set_script({})
    camera.capture(SET)
    count = stand.faulty.count

    def struck(faulty, call):
        reply = faulty.no_fault(call)
        signal.raise_signal(number)
        return reply

    for step in range(count):
        stand.faulty.set_script({step + k: struck for k in range(times)})
        stand.parked.clear()
        with pytest.raises(Ended):
            camera.capture(SET)
        assert stand.device.is_parked, f"{times} signals from command {step} on"
        assert stand.parked == ["stage"]


@pytest.mark.parametrize("first_raises", [True, False])
def test_signals_between_any_two_lines_after_the_work_leave_the_laser_off(stand, first_raises: bool) -> None:
    """The moments between the end of the work and the mask: a signal at every line executed from there on."""
    files = {parking.__file__, camera_module.__file__, sys.modules[SignalGuard.__module__].__file__}
    camera = stand.camera()
    for moment in range(FOLLOWING_LINES):
        lines = [-1]

        def trace(frame, event, _argument, lines=lines, moment=moment):
            if frame.f_code.co_filename not in files:
                return None
            if event == "line" and lines[0] >= 0:
                lines[0] += 1
                if lines[0] == moment + 1:
                    signal.raise_signal(signal.SIGTERM)
            return trace

        def progress(step: str, _done: float, lines=lines) -> None:
            if step == "scan" and stand.device.parameters.laser_power > 0:
                lines[0] = 0
                if first_raises:
                    signal.raise_signal(signal.SIGINT)
                raise TransportError("the cable is out", "put it in")

        sys.settrace(trace)
        try:
            with pytest.raises((Ended, TransportError)):
                camera.capture(SET, progress)
        finally:
            sys.settrace(None)
        assert lines[0] > 0
        assert stand.device.is_parked, f"a signal at line {moment} after the work"


def test_a_signal_that_came_while_parking_is_delivered_after_it(stand) -> None:
    camera = stand.camera(park=(lambda: signal.raise_signal(signal.SIGTERM), lambda: stand.parked.append("stage")))
    with pytest.raises(Ended):
        camera.capture(SET)
    assert stand.device.is_parked
    assert stand.parked == ["stage"]


def test_a_signal_without_a_handler_raises_instead_of_ending_the_process_at_once(stand) -> None:
    camera = stand.camera()
    before = signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with pytest.raises(SystemExit) as ended:
            camera.capture(SET, lambda step, _done: signal.raise_signal(signal.SIGTERM))
    finally:
        signal.signal(signal.SIGTERM, before)
    assert ended.value.code == 128 + signal.SIGTERM
    assert stand.device.is_parked


def test_an_ignored_signal_stays_ignored(stand) -> None:
    camera = stand.camera()
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        scan = camera.capture(SET, lambda step, _done: signal.raise_signal(signal.SIGHUP))
    finally:
        signal.signal(signal.SIGHUP, before)
    assert scan.measured.all()


def test_a_handler_that_only_takes_note_sees_every_signal() -> None:
    seen: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _frame: seen.append(number))
    try:
        run_parked(lambda: [signal.raise_signal(signal.SIGINT) for _ in range(3)], [])
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(seen) == 3


def test_parking_that_fails_says_that_the_laser_may_be_on(stand) -> None:
    camera = stand.camera()
    with pytest.raises(HardwareFault) as caught:
        camera.capture(SET, lambda step, done: _break(stand))
    assert caught.value.__notes__[-1] == LASER_MAY_BE_ON
    with pytest.raises(TransportError) as again:
        camera.close()
    assert LASER_MAY_BE_ON in again.value.__notes__


def _break(stand) -> None:
    stand.faulty.connected = False
    raise HardwareFault("the motor has failed", "it needs service")


def test_parking_has_a_short_deadline_of_its_own(stand) -> None:
    camera = stand.camera()
    body = camera._body()
    body.set_parameters(replace(body.read_parameters(), laser_power=200, mode=ShotMode.FINE_COLOUR))
    limits: list[float] = []
    execute = stand.faulty.execute

    def silent(cdb, data_out, length):
        stand.clock.sleep(PARK_COMMAND_S)
        raise TransportError("the scanner did not answer in time", "check the cable")

    transport = camera._link.transport
    run = transport.execute
    transport.execute = lambda *args: (limits.append(args[3]), run(*args))[1]
    stand.faulty.execute = silent
    start = stand.clock()
    with pytest.raises(TransportError) as caught:
        camera.close()
    assert stand.clock() - start <= PARK_S + PARK_COMMAND_S
    assert max(limits) <= PARK_COMMAND_S
    assert LASER_MAY_BE_ON in caught.value.__notes__
    stand.faulty.execute = execute


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_a_disk_that_fills_up_while_recording_leaves_the_capture_and_the_parking_alone(
    stand, tmp_path, caplog, share: float
) -> None:
    limit = round(share * recorded_bytes(stand, tmp_path / "whole.jsonl"))
    path = tmp_path / "cut.jsonl"
    with limited_file(path, limit) as transport:
        camera = Vivid900(replace(stand.link(), transport=transport(stand)), stand.profile, calibrations(None))
        assert camera.capture(SET).measured.all()
        assert stand.device.is_parked
        camera.close()
    assert "recording ends" in caplog.text


def recorded_bytes(stand, path: Path) -> int:
    with path.open("w") as file:
        link = replace(stand.link(), transport=Recorder(stand.link().transport, file))
        Vivid900(link, stand.profile, calibrations(None)).capture(SET)
    return path.stat().st_size


@contextmanager
def limited_file(path: Path, limit: int):
    """Recorders whose file the kernel refuses to let grow beyond a limit, as a full disk does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    with path.open("w") as file:
        recorder = []

        def transport(stand):
            recorder.append(Recorder(stand.link().transport, file))
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
            return recorder[0]

        try:
            yield transport
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
            signal.signal(signal.SIGXFSZ, handler)

"""Every controller of the table, over a real pseudo-terminal: it turns, it stands, and every fault is declared."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache

import pytest
from serial import SerialTimeoutException

from drivers.scanner import DeviceError, TransportError
from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.stage import MACHINES, Fault, PtyStage, machine
from drivers.stage import CONTROLLERS, WRITE_TIMEOUT_S, RotaryStage, open_port
from drivers.stage.protocol import FIRST_TIMEOUT_S, TIMEOUT_S
from drivers.stage.rotary import POLL_S, SETTLE_S

SILENT = ("CSG-602R v2.0", "CSG-602R v1.0")  # never answer: what does not come is not missed
ONE_BYTE = ("isel(RF-1)", "isel(R-1)")  # no part of their answer is missing when it is cut in half
EVERY_FAULT: tuple[Fault, ...] = ("silence", "garbage", "partial", "late", "unplug")
FAULTS = [
    (model, fault)
    for model in MACHINES
    for fault in EVERY_FAULT
    if model not in SILENT and not (fault == "partial" and model in ONE_BYTE)
]
ROUND_OFF_DEG = 1e-9
CTRL_C_S = 3.0  # what an operator waits after Ctrl-C before pressing it again
KERNEL_DRAIN_S = 30.0  # closing_wait of the kernel's serial drivers: how long closing waits for unsent bytes
POLLS = 40  # of the driver, for the kernel to carry a byte through the terminal
HALF_PULSE = 0.5 + 1e-9


@contextmanager
def connected(
    model: str, faults: Mapping[int, Fault] | None = None, *, relative: bool = False
) -> Iterator[tuple[RotaryStage, PtyStage]]:
    controller = CONTROLLERS[model]
    with PtyStage(machine(model, relative=relative), faults=faults) as fake:
        port = open_port(fake.port, controller)
        with RotaryStage(port, controller, relative=relative, clock=fake.clock, sleep=fake.sleep) as stage:
            yield stage, fake
        assert not port.is_open


@cache
def answers_of_the_setup(model: str) -> int:
    """How many answers a controller gives until it stands at home."""
    with connected(model) as (stage, fake):
        stage.start()
        return fake.answered


@pytest.mark.parametrize("model", CONTROLLERS)
class TestEveryController:
    def test_it_starts_at_home(self, model: str) -> None:
        with connected(model) as (stage, fake):
            assert stage.angle_deg is None
            stage.start()
            assert stage.angle_deg == 0.0
            assert not fake.moving
            assert fake.angle_deg == 0.0

    def test_it_stands_at_the_angle_when_the_call_returns(self, model: str) -> None:
        pulse = 360 / CONTROLLERS[model].pulses
        with connected(model) as (stage, fake):
            stage.start()
            for wanted in (90.0, 225.0, 30.123456, -45.0, 725.0, 0.0):
                reached = stage.turn_to(wanted)
                assert not fake.moving
                assert abs((reached - wanted + 180) % 360 - 180) <= HALF_PULSE * pulse
                assert fake.angle_deg % 360 == pytest.approx(reached, abs=ROUND_OFF_DEG)
            assert fake.machine.refused == []

    def test_home_and_finish_bring_it_back(self, model: str) -> None:
        with connected(model) as (stage, fake):
            stage.start()
            stage.turn_to(60.0)
            stage.home()
            assert (stage.angle_deg, fake.angle_deg) == (0.0, 0.0)
            stage.turn_to(300.0)
            stage.finish()
            assert (fake.angle_deg, fake.moving) == (0.0, False)
            assert fake.machine.refused == []

    def test_nothing_is_sent_to_turn_to_where_it_stands(self, model: str) -> None:
        with connected(model) as (stage, fake):
            stage.start()
            before = fake.heard
            assert stage.turn_to(360.0) == 0.0
            assert fake.heard == before

    def test_leaving_in_the_middle_of_a_move_stops_it(self, model: str) -> None:
        with pytest.raises(KeyboardInterrupt), connected(model) as (stage, fake):
            stage.start()
            interrupt_during(stage, fake, after_s=2.0)
        assert not fake.moving
        assert fake.machine.refused == []
        turned = abs(fake.machine.angle_deg(fake.clock()))
        assert 5.0 < turned < 90.0

    def test_after_a_stop_it_must_be_started_again(self, model: str) -> None:
        with connected(model) as (stage, _):
            stage.start()
            stage.stop()
            assert stage.angle_deg is None
            with pytest.raises(DeviceError, match="not known"):
                stage.turn_to(10.0)
            stage.start()
            assert stage.turn_to(90.0) == pytest.approx(90.0, abs=ROUND_OFF_DEG)

    def test_a_turntable_unplugged_at_rest_is_reported_by_the_next_turn_and_at_exit(self, model: str) -> None:
        with pytest.raises(TransportError, match="broke"), connected(model) as (stage, fake):
            stage.start()
            fake.unplug()
            with pytest.raises(TransportError, match="broke"):
                stage.turn_to(90.0)

    def test_what_is_said_unasked_is_refused(self, model: str) -> None:
        with connected(model) as (stage, fake):
            stage.start()
            fake.say(b"!?")
            with pytest.raises(DeviceError, match="unasked"):
                stage.turn_to(90.0)
            stage.start()
            stage.turn_to(90.0)


@pytest.mark.parametrize(("model", "fault"), FAULTS)
def test_a_fault_is_declared_in_time_and_the_stage_stands(model: str, fault: Fault) -> None:
    for index, limit in ((0, FIRST_TIMEOUT_S), (answers_of_the_setup(model), TIMEOUT_S)):
        asked = 0.0
        error = TransportError if fault == "unplug" else DeviceError
        with pytest.raises(error) as caught, connected(model, {index: fault}) as (stage, fake):
            stage.start()
            asked = fake.clock()
            stage.turn_to(90.0)
        assert caught.value.hint
        assert fake.clock() - asked < limit + SETTLE_S + POLLS * POLL_S
        assert stage.angle_deg is None
        assert fault == "unplug" or not fake.moving


@pytest.mark.parametrize("model", [model for model in MACHINES if CONTROLLERS[model].ambiguous])
def test_a_controller_that_takes_ways_reaches_the_same_angles(model: str) -> None:
    with connected(model, relative=True) as (stage, fake):
        stage.start()
        for wanted in (90.0, 225.0, 30.0, 0.0):
            assert stage.turn_to(wanted) == pytest.approx(wanted, abs=ROUND_OFF_DEG)
            assert fake.angle_deg % 360 == pytest.approx(wanted, abs=ROUND_OFF_DEG)


@pytest.mark.parametrize("model", SILENT)
def test_even_a_silent_controller_may_not_speak(model: str) -> None:
    with connected(model) as (stage, fake):
        stage.start()
        fake.say(b"E")
        with pytest.raises(DeviceError):
            stage.turn_to(90.0)


def test_a_fault_that_stops_the_work_is_not_hidden_by_one_on_the_way_out() -> None:
    with pytest.raises(ZeroDivisionError) as caught, connected("ZETA6104") as (_, fake):
        fake.unplug()
        raise ZeroDivisionError
    assert "could not be stopped" in caught.value.__notes__[0]


@pytest.mark.parametrize("model", CONTROLLERS)
def test_ctrl_c_with_a_silent_controller_takes_three_seconds_at_most(model: str) -> None:
    struck = [0.0]
    silence = dict.fromkeys(range(answers_of_the_setup(model), 1000), "silence")
    with pytest.raises(KeyboardInterrupt), connected(model, silence) as (stage, fake):
        stage.start()

        def sleep(seconds: float) -> None:
            fake.sleep(seconds)
            if fake.clock() > struck[0] + 0.5 and stage._sleep is sleep:
                stage._sleep = fake.sleep
                struck[0] = fake.clock()
                raise KeyboardInterrupt

        stage._sleep, struck[0] = sleep, fake.clock()
        stage.turn_to(180.0)
    assert fake.clock() - struck[0] <= CTRL_C_S


class BlockedPort:
    """A port whose handshake wire lets nothing out: every write ends at its time-out, the kernel keeps the bytes."""

    in_waiting, waiting = 0, 0

    def __init__(self, clock: VirtualClock) -> None:
        self.clock = clock

    def read(self, size: int = 1) -> bytes:
        return b""

    def write(self, data: bytes) -> int:
        self.clock.sleep(WRITE_TIMEOUT_S)
        self.waiting += len(data)
        raise SerialTimeoutException("Write timeout")

    def reset_input_buffer(self) -> None: ...

    def reset_output_buffer(self) -> None:
        self.waiting = 0

    def close(self) -> None:
        if self.waiting:
            self.clock.sleep(KERNEL_DRAIN_S)


@pytest.mark.parametrize("model", CONTROLLERS)
def test_a_controller_that_is_off_is_left_in_three_seconds(model: str) -> None:
    clock = VirtualClock()
    stage = RotaryStage(BlockedPort(clock), CONTROLLERS[model], clock=clock, sleep=clock.sleep)
    with pytest.raises(TransportError, match="broke"), stage:
        stage.start()
    assert clock() <= CTRL_C_S


def test_time_may_be_real() -> None:
    controller = CONTROLLERS["MMC-2"]
    fast = machine("MMC-2")
    fast.notes["speed"] = 1e7
    with (
        PtyStage(fast, clock=time.monotonic) as fake,
        RotaryStage(open_port(fake.port, controller), controller) as stage,
    ):
        stage.start()
        assert stage.turn_to(120.0) == pytest.approx(120.0, abs=ROUND_OFF_DEG)
        assert fake.angle_deg == pytest.approx(120.0, abs=ROUND_OFF_DEG)


def interrupt_during(stage: RotaryStage, fake: PtyStage, *, after_s: float) -> None:
    """Ctrl-C in the first move later than so many seconds after the command to turn by half a turn."""
    start = fake.clock()

    def sleep(seconds: float) -> None:
        fake.sleep(seconds)
        # A controller that moves in steps stands still for a moment between two of them.
        if fake.clock() > start + after_s and fake.moving and stage._sleep is sleep:
            stage._sleep = fake.sleep
            raise KeyboardInterrupt

    stage._sleep = sleep
    stage.turn_to(180.0)

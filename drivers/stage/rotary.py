"""The turntable: runs its controller's protocol over a serial port."""

from __future__ import annotations

import termios
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Protocol

from drivers.safety.device_context import DeviceContext
from drivers.safety.parking import run_parked
from drivers.safety.signals import SignalGuard
from drivers.scanner import DeviceError, ScannerError, TransportError
from drivers.stage import protocol
from drivers.stage.controllers import Controller
from drivers.stage.protocol import Answer, Exchange

POLL_S = 0.1  # a character takes 1 ms at 9600 baud, a turn half a minute
SETTLE_S = 0.5  # answers that are pending at a stop arrive within this
STOP_WAIT_S = 1.5  # for the end of a move that no command stops: its steps take a second
UNPLUGGED = "check the cable, its adapter and the controller's power, and start again"


class Port(Protocol):
    """The part of pyserial's `Serial` that is used."""

    @property
    def in_waiting(self) -> int: ...

    def read(self, size: int = 1, /) -> bytes: ...

    def write(self, data: bytes, /) -> int | None: ...

    def reset_input_buffer(self) -> None: ...

    def reset_output_buffer(self) -> None: ...

    def close(self) -> None: ...


class RotaryStage(DeviceContext):
    """A turntable. Leaving the context stops it.

    controller  the row of the table.
    relative    whether the controller takes the number of `rotate` relative to its present position, not to home.
    clock       monotonic seconds; `sleep` waits on that clock.
    """

    close_failure = "the turntable could not be stopped"

    def __init__(
        self,
        port: Port,
        controller: Controller,
        *,
        relative: bool = False,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self.controller = controller
        self._port, self._relative, self._clock, self._sleep = port, relative, clock, sleep
        self._pulses: int | None = None
        self._pending: tuple[Answer, float] | None = None  # a pending answer and its deadline
        self._open = True

    @property
    def angle_deg(self) -> float | None:
        """Position, 0 up to 360 degrees from home; None before `start` and after a fault."""
        return None if self._pulses is None else protocol.angle(self.controller, self._pulses)

    def start(self) -> None:
        """Set the controller up and go home, to 0°.

        Raises DeviceError when it answers wrongly or not in time, TransportError when the way to it breaks.
        """
        with self._translated():
            self._port.reset_input_buffer()
        self._exchange(protocol.initialise(self.controller))
        self.home()

    def home(self) -> None:
        """Go to 0°. Raises as `start`."""
        if self._pulses is not None and self.controller.pulses_at_once:
            self._approach(self._pulses, 0)
        self._exchange(protocol.home(self.controller))
        self._pulses = 0

    def turn_to(self, angle_deg: float) -> float:
        """Go to an angle from home, by less than a full rotation.

        Returns the angle of the nearest pulse, 0 up to 360. Raises as `start`, and DeviceError when the position is
        unknown.
        """
        if self._pulses is None:
            raise DeviceError("the turntable's position is not known", "start it again: it then goes home")
        here, there = self._pulses, protocol.position(self.controller, angle_deg)
        way = (there - here) % self.controller.pulses if self._relative else there - here
        if way and self._relative:
            self._exchange(protocol.rotate(self.controller, way, travel=abs(way)))
        else:
            self._approach(here, there)
        self._pulses = there
        return protocol.angle(self.controller, there)

    def finish(self) -> None:
        """Go home and end the run. Raises as `start`."""
        if self._pulses is not None and self.controller.pulses_at_once:
            self._approach(self._pulses, 0)
        self._exchange(protocol.finish(self.controller))
        self._pulses = None

    def stop(self) -> None:
        """Stop at once; the position is then unknown.

        A controller without a stop command finishes its step first. Raises TransportError when the connection is
        broken, DeviceError when the stage may still be turning.
        """
        self._pulses = None
        with self._translated():
            if self.controller.stop:
                self._port.write(self.controller.stop)
            elif self._pending:
                self._await_end(*self._pending)
            deadline = self._clock() + SETTLE_S
            while self._clock() < deadline:
                self._sleep(POLL_S)
            self._port.reset_input_buffer()
        self._pending = None

    def close(self) -> None:
        """Stop the stage and close the port. Safe to call twice.

        Raises TransportError when it could not be stopped.
        """
        if not self._open:
            return
        self._open = False
        run_parked(lambda: None, [self.stop, self._close_port])

    def _close_port(self) -> None:
        with self._translated():
            # Where RTS/CTS holds back what was written, closing would wait for it, 30 s in the kernel's drivers.
            self._port.reset_output_buffer()
            self._port.close()

    def _approach(self, here: int, there: int) -> None:
        """Go from one absolute position to another.

        The move is split where no command could stop the whole of it.
        """
        step = self.controller.pulses_at_once or self.controller.pulses
        while here != there:
            here, before = here + max(-step, min(step, there - here)), here
            self._exchange(protocol.rotate(self.controller, here, travel=abs(here - before)))

    def _exchange(self, exchange: Exchange) -> None:
        """Send, and wait until the answer is complete and the stage has stopped.

        Ctrl-C or another ending signal stops the stage before anything else.
        """
        with SignalGuard() as signals:
            try:
                self._send_and_wait(exchange)
            except Exception:
                raise
            except BaseException:
                signals.hold()
                with suppress(ScannerError):  # `close` tries again and reports
                    self.stop()
                raise

    def _send_and_wait(self, exchange: Exchange) -> None:
        self._pulses = None  # unless all goes well
        answer, sent = Answer(exchange), self._clock()
        deadline = sent + exchange.timeout_s
        with self._translated():
            self._reject_unsolicited(exchange)
            self._pending = answer, deadline
            self._port.write(exchange.sent)
            while not answer.complete or self._clock() < sent + exchange.motion_s:
                answer.feed(self._port.read(self._port.in_waiting))
                if not answer.complete and self._clock() > deadline:
                    raise DeviceError(
                        f"the turntable answered {answer.got} within {exchange.timeout_s:g} s",
                        "check its power, its cable, and `model` and `port` in [turntable]",
                    )
                self._sleep(POLL_S)
        self._pending = None

    def _await_end(self, answer: Answer, deadline: float) -> None:
        """Wait for the end of a move that cannot be stopped.

        Called again for the same move, it does not wait again. Raises DeviceError when the answer does not come soon.
        """
        end = min(deadline, self._clock() + STOP_WAIT_S)
        self._pending = answer, end
        with suppress(DeviceError):
            while not answer.complete and self._clock() < end:
                answer.feed(self._port.read(self._port.in_waiting))
                self._sleep(POLL_S)
        if not answer.complete:
            raise DeviceError("the turntable may still be turning", "switch it off")

    def _reject_unsolicited(self, exchange: Exchange) -> None:
        """Raise DeviceError for unread bytes.

        Unsolicited or late, they would put all later answers out of step.
        """
        waiting = self._port.read(self._port.in_waiting)
        if waiting.strip(exchange.ignored) if exchange.ignored else waiting:
            raise DeviceError(f"the turntable said {waiting!r} unasked", "start it again")

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except (OSError, termios.error) as error:  # pyserial's own errors are OSErrors, but it does not wrap all
            raise TransportError(f"the way to the turntable broke: {error}", UNPLUGGED) from error

"""What is said to a controller and what it must answer, without any input or output."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.scanner import DeviceError
from drivers.vivid900.stage.controllers import Controller

FIRST_TIMEOUT_S, TIMEOUT_S = 10.0, 60.0  # the table's own: for the first answer, and for every other
RAMP_S = 0.4  # speeding up and slowing down, 200 ms each in every `initialise` that names a speed
MARGIN = 1.5  # on a move whose end no answer tells of: its speed is our reading of the string that sets it
MOST_NOISE = 4096  # bytes before the first answer: an echo or a greeting is a line or two
SHOWN = 40  # bytes of an answer that a message quotes


@dataclass(frozen=True)
class Exchange:
    """One string to send and what it brings.

    answer     all of the answer, byte for byte; empty when none will come.
    ignored    bytes that may stand anywhere in it.
    preface    whether anything may come before it: an echo, or a greeting.
    timeout_s  time within which the answer must be complete.
    stands_s   time after which the stage stands, counted from the sending; 0 when the answer tells.
    """

    sent: bytes
    answer: bytes
    ignored: bytes = b""
    preface: bool = False
    timeout_s: float = TIMEOUT_S
    stands_s: float = 0.0


def initialise(controller: Controller) -> Exchange:
    """The first thing to say. It may send the stage home from anywhere."""
    return Exchange(
        controller.initialise,
        _answer(controller, controller.initialise),
        controller.ignored,
        preface=controller.echoes,
        timeout_s=FIRST_TIMEOUT_S,
        stands_s=travel_s(controller, controller.pulses) if b"H:" in controller.initialise else 0.0,
    )


def rotate(controller: Controller, pulses: int, *, travel: int) -> Exchange:
    """Go to a position in pulses, `travel` pulses away.

    Raises ValueError for a negative position: the table's strings hold the sign, and no number with a second one.
    """
    if pulses < 0:
        raise ValueError(f"{pulses} pulses: positions count from 0")
    return _move(controller, controller.rotate % pulses, travel)


def home(controller: Controller) -> Exchange:
    """Go to the home position, from anywhere."""
    return _move(controller, controller.home, controller.pulses)


def finish(controller: Controller) -> Exchange:
    """The last thing to say after a good run: it goes home."""
    return _move(controller, controller.finish, controller.pulses)


def travel_s(controller: Controller, pulses: int) -> float:
    """Time in which the stage surely has gone so many pulses, 0 when its answer tells."""
    return 0.0 if controller.pulses_per_s is None else MARGIN * (pulses / controller.pulses_per_s + RAMP_S)


def position(controller: Controller, angle_deg: float) -> int:
    """The nearest pulse, 0 up to a turn, at an angle."""
    return round(angle_deg / controller.pulse_deg) % controller.pulses


def angle(controller: Controller, pulses: int) -> float:
    """The angle, 0 up to 360 degrees, at a position in pulses."""
    return pulses * controller.pulse_deg % 360.0


def _move(controller: Controller, sent: bytes, travel: int) -> Exchange:
    return Exchange(sent, _answer(controller, sent), controller.ignored, stands_s=travel_s(controller, travel))


def _answer(controller: Controller, sent: bytes) -> bytes:
    return controller.reply * sum(map(bool, controller.parts.split(sent)))


class Answer:
    """The answer to one exchange as it comes in.

    feed(data) takes the next bytes; `complete` tells when all have come.
    """

    def __init__(self, exchange: Exchange) -> None:
        self._exchange, self._got, self._preface = exchange, b"", 0

    @property
    def complete(self) -> bool:
        """Whether the whole answer has come."""
        return self._got == self._exchange.answer

    @property
    def got(self) -> str:
        """What has come so far, for a message."""
        return _quoted(self._got) if self._got else "nothing"

    def feed(self, data: bytes) -> None:
        """Take the next bytes. Raises DeviceError for the first that does not belong to the answer."""
        for value in data:
            byte = bytes([value])
            if self._exchange.answer.startswith(self._got + byte) and not self.complete:
                self._got += byte
            elif self._exchange.preface and not self.complete:
                self._skip(byte)
            elif byte not in self._exchange.ignored:
                raise DeviceError(
                    f"the rotary stage answered {_quoted(self._got + data)} to {_quoted(self._exchange.sent)}",
                    "check that `model` in [stage] names the controller, switch it off and on, and start again",
                )

    def _skip(self, byte: bytes) -> None:
        """Before the first answer: start looking for it again."""
        self._preface += 1
        if self._preface > MOST_NOISE:
            raise DeviceError(
                f"the rotary stage sends without end: {_quoted(self._got)} …",
                "check `port` in [stage]: something else may be connected there",
            )
        seen, answer = self._got + byte, self._exchange.answer
        self._got = next(seen[i:] for i in range(1, len(seen) + 1) if answer.startswith(seen[i:]))


def _quoted(data: bytes) -> str:
    return repr(data[:SHOWN])[1:] + (" …" if len(data) > SHOWN else "")

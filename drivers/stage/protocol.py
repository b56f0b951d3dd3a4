"""Protocol core of the controllers: strings and answers, without I/O."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.scanner import DeviceError
from drivers.stage.controllers import Controller

FIRST_TIMEOUT_S, TIMEOUT_S = 10.0, 60.0  # the table's own: for the first answer, and for every other
RAMP_S = 0.4  # acceleration and deceleration, 200 ms each in every `initialise` that names a speed
MARGIN = 1.5  # safety factor of a move whose end is not answered: its speed is our reading of the string that sets it
MAX_PREAMBLE = 4096  # bytes before the first answer: an echo or a banner is a line or two
QUOTED_BYTES = 40  # bytes of an answer that a message quotes


@dataclass(frozen=True)
class Exchange:
    """String to send and its expected answer.

    answer: the whole answer; empty when the controller sends none.
    ignored: bytes that may stand anywhere in it.
    preface: whether other bytes may precede it: an echo, or a banner.
    timeout_s: time within which the answer must be complete.
    motion_s: duration of the motion from sending on; 0 when the answer reports its end.
    """

    sent: bytes
    answer: bytes
    ignored: bytes = b""
    preamble: bool = False
    timeout_s: float = TIMEOUT_S
    motion_s: float = 0.0


def initialise(controller: Controller) -> Exchange:
    """Return the exchange that sets the controller up.

    Some controllers also go home, from anywhere.
    """
    return Exchange(
        controller.initialise,
        _answer(controller, controller.initialise),
        controller.ignored,
        preamble=controller.echoes,
        timeout_s=FIRST_TIMEOUT_S,
        motion_s=travel_s(controller, controller.pulses) if b"H:" in controller.initialise else 0.0,
    )


def rotate(controller: Controller, pulses: int, *, travel: int) -> Exchange:
    """The exchange that rotates to a position in pulses, `travel` pulses away.

    Raises ValueError for a negative position: the table's strings contain the sign already.
    """
    if pulses < 0:
        raise ValueError(f"{pulses} pulses: positions count from 0")
    return _move(controller, controller.rotate % pulses, travel)


def home(controller: Controller) -> Exchange:
    """The exchange that goes to the home position, from anywhere."""
    return _move(controller, controller.home, controller.pulses)


def finish(controller: Controller) -> Exchange:
    """The exchange that ends a successful run: the stage goes home."""
    return _move(controller, controller.finish, controller.pulses)


def travel_s(controller: Controller, pulses: int) -> float:
    """Return an upper bound of the time for a move of `pulses`, s.

    Returns 0 when the answer reports the end.
    """
    return 0.0 if controller.pulses_per_s is None else MARGIN * (pulses / controller.pulses_per_s + RAMP_S)


def position(controller: Controller, angle_deg: float) -> int:
    """The nearest pulse, 0 up to a turn, at an angle."""
    return round(angle_deg / controller.pulse_deg) % controller.pulses


def angle(controller: Controller, pulses: int) -> float:
    """The angle, 0 up to 360 degrees, at a position in pulses."""
    return pulses * controller.pulse_deg % 360.0


def _move(controller: Controller, sent: bytes, travel: int) -> Exchange:
    return Exchange(sent, _answer(controller, sent), controller.ignored, motion_s=travel_s(controller, travel))


def _answer(controller: Controller, sent: bytes) -> bytes:
    return controller.reply * sum(map(bool, controller.parts.split(sent)))


class Answer:
    """Parser of the answer to one exchange: `feed` takes bytes until `complete`."""

    def __init__(self, exchange: Exchange) -> None:
        self._exchange, self._got, self._preamble_bytes = exchange, b"", 0

    @property
    def complete(self) -> bool:
        """Whether the whole answer was received."""
        return self._got == self._exchange.answer

    @property
    def got(self) -> str:
        """The bytes received so far, quoted for a message."""
        return _quoted(self._got) if self._got else "nothing"

    def feed(self, data: bytes) -> None:
        """Take the next bytes.

        Raises DeviceError for the first byte that does not belong to the answer.
        """
        for value in data:
            byte = bytes([value])
            if self._exchange.answer.startswith(self._got + byte) and not self.complete:
                self._got += byte
            elif self._exchange.preamble and not self.complete:
                self._skip(byte)
            elif byte not in self._exchange.ignored:
                raise DeviceError(
                    f"the turntable answered {_quoted(self._got + data)} to {_quoted(self._exchange.sent)}",
                    "check that `model` in [turntable] names the controller, switch it off and on, and start again",
                )

    def _skip(self, byte: bytes) -> None:
        """Skip a byte of the preamble and restart the search for the answer."""
        self._preamble_bytes += 1
        if self._preamble_bytes > MAX_PREAMBLE:
            raise DeviceError(
                f"the turntable sends without end: {_quoted(self._got)} …",
                "check `port` in [turntable]: something else may be connected there",
            )
        seen, answer = self._got + byte, self._exchange.answer
        self._got = next(seen[i:] for i in range(1, len(seen) + 1) if answer.startswith(seen[i:]))


def _quoted(data: bytes) -> str:
    return repr(data[:QUOTED_BYTES])[1:] + (" …" if len(data) > QUOTED_BYTES else "")

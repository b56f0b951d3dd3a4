"""Command dialects of the nine simulated controllers.

They are four dialects, each as strict as its devices. They are written from what the commands mean and have nothing in
common with the driver but the pulses to a rotation. What no source states (which commands are answered, and when) is
the assumption named in the driver's table.
"""

from __future__ import annotations

import re

from drivers.simulated.device.stage.controller import Action, Dialect, Machine

TURN_S = 30.0  # for a turn, where no command sets the speed
NEVER = re.compile(rb"(?!)")


def _nothing(_machine: Machine, _match: re.Match[bytes], _now: float) -> None:
    """A setting that changes nothing that can be seen from outside."""


def _halt(machine: Machine, _match: re.Match[bytes], now: float) -> None:
    machine.axle.halt(now)


def _aim(machine: Machine, match: re.Match[bytes], now: float) -> None:
    here = machine.axle.position(now) if machine.notes.get("relative") else 0.0
    machine.notes["target"] = here + int(match["pulses"])


def _speed(machine: Machine) -> float:
    return float(machine.notes.get("speed", abs(machine.pulses) / TURN_S))


def _go(machine: Machine, _match: re.Match[bytes], now: float) -> None:
    machine.axle.go(machine.notes.get("target", 0.0), _speed(machine), now)


def _aim_and_go(machine: Machine, match: re.Match[bytes], now: float) -> None:
    _aim(machine, match, now)
    _go(machine, match, now)


def _home(machine: Machine, _match: re.Match[bytes], now: float) -> None:
    """To the origin switch, which lies where the stage was switched on."""
    machine.axle.go(0.0, _speed(machine), now)


def _set_speed(machine: Machine, match: re.Match[bytes], _now: float) -> None:
    machine.notes["speed"] = float(match["speed"])


def _zero_here(machine: Machine, _match: re.Match[bytes], now: float) -> None:
    machine.notes["zero"] = machine.notes.get("zero", 0.0) + machine.axle.position(now)
    machine.axle.count_from(0.0)


def _echo_off(machine: Machine, _match: re.Match[bytes], _now: float) -> None:
    machine.notes["echo"] = False


def _sigma(answer: bytes, refusal: bytes, *more: tuple[bytes, Action]) -> Dialect:
    """Return the dialect of Sigma Koki.

    A move is accepted at once and runs on its own; until it ends only L: is heard.
    """
    table: tuple[tuple[bytes, Action], ...] = (
        (rb"D:(?:1|2|W)(?:S\d+F(?P<speed>\d+)R\d+)(?:S\d+F\d+R\d+)?", _set_speed),
        (rb"M:1\+P(?P<pulses>\d+)", _aim),
        (rb"G:", _go),
        (rb"H:1-?", _home),
        (rb"L:(?:1|E)", _halt),
        *more,
    )
    return Dialect(re.compile(rb"\r\n"), _compiled(table), answer, refusal, NEVER, re.compile(rb"L:(?:1|E)"), busy=True)


def _compiled(table: tuple[tuple[bytes, Action], ...]) -> dict[re.Pattern[bytes], Action]:
    return {re.compile(pattern): act for pattern, act in table}


CSG = _sigma(b"", b"")
MARK = _sigma(b"OK\r\n", b"NG\r\n", (rb"S:\d+", _nothing))


def _isel_move(machine: Machine, match: re.Match[bytes], now: float) -> None:
    _set_speed(machine, match, now)
    _aim_and_go(machine, match, now)


# `@01` names one axis, `@0M` moves and is answered when the move has ended; no way to stop is known.
ISEL = Dialect(
    re.compile(rb"\r"),
    _compiled(((rb"@01", _nothing), (rb"@0M(?P<pulses>\d+), ?\+(?P<speed>\d+)", _isel_move), (rb"@0R", _nothing))),
    answer=b"0\r\n",
    refusal=b"1\r\n",
    waits=re.compile(rb"@0M.*"),
    urgent=NEVER,
)

# Compumotor 6000: a prompt for every command, after an echo until that is switched off; COMEXC0 lets no command pass
# one that still moves.
ZETA = Dialect(
    re.compile(rb"[\r ]"),
    _compiled(
        (
            (rb"ECHO0", _echo_off),
            (rb"COMEXC0|MA1|A8|V8|WAIT\(1PE<>1\)", _nothing),
            (rb"PSET0", _zero_here),
            (rb"D(?P<pulses>\d+)", _aim),
            (rb"GO1", _go),
            (rb"!S|RESET", _halt),
        )
    ),
    answer=b"\r\n> ",
    refusal=b"\r\n? ",
    waits=re.compile(rb"GO1|WAIT.*"),
    urgent=re.compile(rb"!S"),
)

MMC = Dialect(
    re.compile(rb"\r\n"),
    _compiled(
        (
            (rb"F:XP3|S:X1|L:X|W:", _nothing),
            (rb"A:XP(?P<pulses>\d+)", _aim_and_go),
            (rb"E:", _halt),
        )
    ),
    answer=b"\r\n",
    refusal=b"?\r\n",
    waits=re.compile(rb"W:"),
    urgent=re.compile(rb"E:"),
)

MACHINES = {
    "CSG-602R v2.0": (CSG, -144_000),
    "CSG-602R v1.0": (CSG, -72_000),
    "Mark-202": (MARK, -5_760_000),
    "Mark-102": (MARK, -144_000),
    "isel(RF-1)": (ISEL, -20_800),
    "isel(R-1)": (ISEL, -7_200),
    "ZETA6104": (ZETA, 4_500_000),
    "MMC-2(15kg)": (MMC, 180_000),
    "MMC-2": (MMC, 72_000),
}
"""Model → its dialect, and pulses to a turn.

Negative where counting up turns the stage clockwise, seen from above.
"""


def machine(model: str, *, relative: bool = False) -> Machine:
    """Return a simulated controller, standing where it was switched on.

    relative: M: counts from the present position.
    """
    dialect, pulses = MACHINES[model]
    return Machine(dialect, pulses, {"relative": relative, "echo": dialect is ZETA})

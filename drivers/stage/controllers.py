"""Table of the nine supported controllers of rotary stages.

Source: the table of controllers built into RapidForm 2004, as published by students who worked with a VI-900
("Protokolle_RF.txt"). Every string is as printed there, apart from the one misprint that is named at its place. All
speak 9600 baud, 8 data bits, no parity, 1 stop bit.

Not in that table, and our assumption: which of the strings' parts are answered, and how long a move takes where no
answer reports its end. Neither has been tried on a real controller.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

BAUD = 9600
LINES, COMMANDS = re.compile(rb"[\r\n]+"), re.compile(rb"[\r\n ]+")
"""Separators between the parts of a string that are answered one by one."""


@dataclass(frozen=True)
class Controller:
    """One row of the table.

    step            degrees that one pulse turns the stage, as printed; negative where counting up turns it back.
    pulses          pulses to a turn, which `step` rounds.
    initialise, home, finish, stop  strings to send; stop is empty where none is known.
    rotate          the same, %d being the position in pulses from the home position.
    reply           what each part of a string is answered with; empty for a controller that never answers.
    parts           what separates the parts.
    ignored         bytes that may stand between answers.
    echoes          whether it echoes commands until `initialise` disables that.
    handshake       whether the RTS and CTS wires are used.
    pulses_at_once  longest move, in pulses, where no command stops it; None where `stop` does.
    pulses_per_s    speed that `initialise` sets, where the answer is not known to wait for the end of the move.
    """

    model: str
    step: str
    pulses: int
    initialise: bytes
    rotate: bytes
    home: bytes
    finish: bytes
    stop: bytes
    reply: bytes = b""
    parts: re.Pattern[bytes] = LINES
    ignored: bytes = b""
    echoes: bool = False
    handshake: bool = True
    pulses_per_s: float | None = None
    pulses_at_once: int | None = None

    @property
    def pulse_deg(self) -> float:
        """Degrees that one pulse turns the stage, with its sign."""
        return (-360.0 if self.step.startswith("-") else 360.0) / self.pulses

    @property
    def ambiguous(self) -> bool:
        """Return whether some firmware interprets `rotate` as a relative move.

        See SIGMA_ROTATE.
        """
        return self.rotate == SIGMA_ROTATE


# Sigma Koki's syntax. Their current manuals read M: as a move from where the stage stands, the table as one from the
# home position; `RotaryStage` can do both.
CSG_INIT = b"D:2S500F5000R200S500F5000R200\r\nH:1-\r\n"
SIGMA_ROTATE, SIGMA_STOP, OK = b"M:1+P%d\r\nG:\r\n", b"L:E\r\n", b"OK\r\n"

# COMEXC0 and PSET0 are printed as `COMEXC0\PSET0`; read as a carriage return that lost its r.
ZETA_INIT = b"ECHO0\rCOMEXC0\rPSET0\rA8\rV8\r"
ZETA_HOME = b"MA1 D0 \rGO1\rWAIT(1PE<>1)\r"

MMC_INIT, MMC_ROTATE, MMC_HOME = b"F:XP3\r\nS:X1\r\n", b"A:XP%d\r\nW:\r\n", b"A:XP0\r\nW:\r\n"
MMC_FINISH, MMC_STOP = b"L:X\r\n" + MMC_HOME, b"E:\r\n"


def _csg(model: str, step: str, pulses: int) -> Controller:
    home = b"L:1\r\nH:1-\r\n"
    return Controller(model, step, pulses, CSG_INIT, SIGMA_ROTATE, home, home, SIGMA_STOP, pulses_per_s=5_000)


def _mark(model: str, step: str, pulses: int, initialise: bytes, home: bytes, pulses_per_s: float) -> Controller:
    return Controller(
        model, step, pulses, initialise, SIGMA_ROTATE, home, home, SIGMA_STOP, OK, pulses_per_s=pulses_per_s
    )


def _isel(model: str, step: str, pulses: int, speed: int) -> Controller:
    rotate, home = b"@0M%%d,+%d\r" % speed, b"@0M0,+%d\r" % speed
    one_second = speed
    return Controller(
        model, step, pulses, b"@01\r", rotate, home, home, b"", b"0", ignored=b"\r\n", pulses_at_once=one_second
    )


def _mmc(model: str, step: str, pulses: int) -> Controller:
    return Controller(model, step, pulses, MMC_INIT, MMC_ROTATE, MMC_HOME, MMC_FINISH, MMC_STOP, b"\r\n")


CONTROLLERS = {
    row.model: row
    for row in (
        _csg("CSG-602R v2.0", "-0.0025", 144_000),
        _csg("CSG-602R v1.0", "-0.005", 72_000),
        _mark("Mark-202", "-0.0000625", 5_760_000, b"S:180\r\nD:1S20000F200000R200\r\n", b"L:1\r\nH:1\r\n", 200_000),
        _mark("Mark-102", "-0.0025", 144_000, b"D:WS500F5000R200S500F5000R200\r\n", b"H:1-\r\n", 5_000),
        _isel("isel(RF-1)", "-0.0173076", 20_800, 600),
        _isel("isel(R-1)", "-0.05", 7_200, 300),
        Controller(
            "ZETA6104",
            "+0.00008",
            4_500_000,
            ZETA_INIT,
            b"MA1 D%d\rGO1\rWAIT(1PE<>1)\r",
            ZETA_HOME,
            ZETA_HOME + b"RESET\r",
            b"!S\r",
            b"\r\n> ",
            COMMANDS,  # the table expects four of them for the rotation: one line holds two of its commands
            echoes=True,
            handshake=False,
        ),
        _mmc("MMC-2(15kg)", "0.002", 180_000),
        _mmc("MMC-2", "0.005", 72_000),
    )
}
"""Model → its row."""

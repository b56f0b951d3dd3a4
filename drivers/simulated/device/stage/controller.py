"""State machine common to all simulated controllers.

An axle, a command queue, answers when they are due.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from drivers.simulated.device.stage.axle import Axle

MAX_UNREAD = 1000  # bytes without an end of line: no controller has room for more

Action = Callable[["Machine", "re.Match[bytes]", float], None]


@dataclass(frozen=True)
class Dialect:
    """Commands and answers of one family of controllers.

    end       what ends a command.
    commands  pattern of a whole command → what it does.
    answer    to an accepted command; refusal to any other.
    waits     commands whose answer, and all that follows, waits for the end of the motion.
    urgent    commands that are executed at once, during a move.
    busy      whether other commands are refused during a move instead of queued.
    """

    end: re.Pattern[bytes]
    commands: Mapping[re.Pattern[bytes], Action]
    answer: bytes
    refusal: bytes
    waits: re.Pattern[bytes]
    urgent: re.Pattern[bytes]
    busy: bool = False


@dataclass
class Machine:
    """One controller with its axle; times are seconds of the caller's clock.

    pulses   to a turn; negative where counting up turns the stage clockwise, seen from above.
    notes    state of the dialect: speed, target, …
    refused  commands that were not understood, or came at the wrong time.
    """

    dialect: Dialect
    pulses: int
    notes: dict[str, Any] = field(default_factory=dict)
    axle: Axle = field(default_factory=Axle)
    refused: list[bytes] = field(default_factory=list)
    _unread: bytes = b""
    _queue: list[bytes] = field(default_factory=list)
    _held: bytes | None = None

    def angle_deg(self, now: float) -> float:
        """How far the stage stands from where it was switched on, counter-clockwise."""
        return (self.axle.position(now) + float(self.notes.get("zero", 0.0))) * 360.0 / self.pulses

    def receive(self, data: bytes, now: float) -> list[bytes]:
        """Take bytes, and return the answers that are given at once; `due` has the others."""
        *commands, self._unread = self.dialect.end.split((self._unread + data)[-MAX_UNREAD:])
        at_once = []
        for command in filter(None, commands):
            if self.dialect.urgent.fullmatch(command):
                self._queue.clear()
                self._held = None
                at_once.append(self._run(command, now))
            else:
                self._queue.append(command)
        return [answer for answer in at_once if answer]

    def due(self, now: float) -> list[bytes]:
        """Process the received commands in order, and return the answers that are due."""
        answers = []
        while self._held is None or not self.axle.moving(now):
            if self._held is not None:
                answers.append(self._held)
                self._held = None
            elif not self._queue:
                break
            else:
                command = self._queue.pop(0)
                self._held = self._run(command, now)
                if not self.dialect.waits.fullmatch(command):
                    answers.append(self._held)
                    self._held = None
        return [answer for answer in answers if answer]

    def _run(self, command: bytes, now: float) -> bytes:
        for pattern, act in self.dialect.commands.items():
            if (match := pattern.fullmatch(command)) and not self._too_early(command, now):
                act(self, match, now)
                return self.dialect.answer
        self.refused.append(command)
        return self.dialect.refusal

    def _too_early(self, command: bytes, now: float) -> bool:
        return self.dialect.busy and self.axle.moving(now) and not self.dialect.urgent.fullmatch(command)

"""A simulated controller at the end of a pseudo-terminal.

It is a serial port that any program can open.
"""

from __future__ import annotations

import os
import select
import threading
import time
import tty
from collections.abc import Callable, Mapping
from contextlib import suppress
from types import TracebackType
from typing import Literal, Self

from drivers.simulated.device.clock import VirtualClock
from drivers.simulated.device.stage.controller import Machine

TICK_S = 0.01  # real time between looks at the clock
READ_BYTES = 4096
# The kernel carries bytes through the terminal in its own time. After every word that was heard or said the next may be
# on its way, and virtual time waits for it that often and, in real seconds, that long.
LOOKS, CARRIED_S = 25, 0.004
LATE_S = 100.0  # later than any time-out
GARBAGE = b"\xffE?\r\n"

Fault = Literal["silence", "garbage", "partial", "late", "unplug"]


class PtyStage:
    """Serves a machine on a pseudo-terminal, in a thread of its own, until it is closed.

    port    name of the serial port.
    faults  index of an answer, counted from 0 → what goes wrong with it.
    clock   seconds that the machine's moves take; they may be the world's, by default they pass only in `sleep`.
    heard, answered  how many bytes came in, and how many answers were due.
    """

    def __init__(
        self, machine: Machine, *, faults: Mapping[int, Fault] | None = None, clock: Callable[[], float] | None = None
    ) -> None:
        self.machine = machine
        self.heard = self.answered = 0
        self._faults = dict(faults or {})
        self.clock = clock or VirtualClock()
        self._late: list[tuple[float, bytes]] = []
        self._lock, self._closing = threading.Lock(), threading.Event()
        # The other end stays open here too: the port outlives the programs that use it.
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self._plugged, self._looks = True, LOOKS
        self._thread = threading.Thread(target=self._run, name=f"stage on {self.port}", daemon=True)
        self._thread.start()

    def sleep(self, seconds: float) -> None:
        """Let time pass, and answer what became due in it."""
        if isinstance(self.clock, VirtualClock):
            self.clock.sleep(seconds)
            self._wait_for_the_kernel()
        else:
            time.sleep(seconds)
        with self._lock:
            self._serve()

    def _wait_for_the_kernel(self) -> None:
        if not self._looks:
            return
        self._looks -= 1
        if not self._plugged:  # the thread may be looking at the terminal, which is there as long as it does
            time.sleep(CARRIED_S)
            return
        with suppress(OSError, ValueError):  # unplugged between the look and the wait
            select.select([self._ours], [], [], CARRIED_S)

    @property
    def angle_deg(self) -> float:
        """Where the stage stands, counter-clockwise from where it was switched on."""
        with self._lock:
            return self.machine.angle_deg(self.clock())

    @property
    def moving(self) -> bool:
        """Whether it moves."""
        with self._lock:
            return self.machine.axle.moving(self.clock())

    def say(self, data: bytes) -> None:
        """Say something unasked, and wait until it is there to be read."""
        with self._lock:
            self._write(data)
            select.select([self._theirs], [], [], 1.0)

    def unplug(self) -> None:
        """Pull the cable out."""
        with self._lock:
            self._pull()

    def close(self) -> None:
        """End the thread and take the port away. Safe to call twice."""
        self._closing.set()
        self._thread.join()
        self.unplug()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _run(self) -> None:
        while not self._closing.is_set() and self._plugged:
            with suppress(OSError, ValueError):  # unplugged between the look and the wait
                select.select([self._ours], [], [], TICK_S)
            with self._lock:
                self._serve()

    def _serve(self) -> None:
        now = self.clock()
        while self._plugged and select.select([self._ours], [], [], 0)[0]:
            data = os.read(self._ours, READ_BYTES)
            self.heard += len(data)
            self._looks = LOOKS
            if self.machine.notes.get("echo"):
                self._write(data)
            self._say(self.machine.receive(data, now), now)
        self._say(self.machine.due(now), now)
        for when, answer in self._late:
            if when <= now:
                self._write(answer)
        self._late = [(when, answer) for when, answer in self._late if when > now]

    def _say(self, answers: list[bytes], now: float) -> None:
        for answer in answers:
            match self._faults.get(self.answered):
                case None:
                    self._write(answer)
                case "garbage":
                    self._write(GARBAGE)
                case "partial":
                    self._write(answer[: len(answer) // 2])
                case "late":
                    self._late.append((now + LATE_S, answer))
                case "unplug":
                    self._pull()
            self.answered += 1

    def _write(self, data: bytes) -> None:
        if self._plugged:
            os.write(self._ours, data)
            self._looks = LOOKS

    def _pull(self) -> None:
        if self._plugged:
            self._plugged, self._looks = False, LOOKS
            os.close(self._theirs)
            os.close(self._ours)

"""The event log of a simulated scanner: tests read from it whether the laser is off."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Event:
    """An event: time in seconds of the device's clock, kind, and details."""

    time: float
    what: str
    detail: str = ""


@dataclass(frozen=True)
class Beam:
    """The laser being on from start to end, seconds, at a power of 1 to 255."""

    start: float
    end: float
    power: int


class Log:
    """Events in order, and the intervals with the laser on."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self.clock = clock
        self.events: list[Event] = []
        self.beams: list[Beam] = []

    def add(self, what: str, detail: str = "") -> None:
        """Note what happens now."""
        self.events.append(Event(self.clock(), what, detail))

    def laser_on(self, start: float, seconds: float, power: int) -> None:
        """Note an interval with the laser on, unless it is switched off before."""
        if power > 0:
            self.beams.append(Beam(start, start + seconds, power))

    def laser_off(self) -> None:
        """Switch the laser off now and cancel later intervals."""
        now = self.clock()
        past = [Beam(beam.start, min(beam.end, now), beam.power) for beam in self.beams if beam.start < now]
        self.beams[:] = past

    def forget_past(self) -> None:
        """Drop the events and the intervals that are over."""
        self.events.clear()
        self.beams[:] = [beam for beam in self.beams if beam.end > self.clock()]

    @property
    def laser_is_on(self) -> bool:
        """Whether the laser is on now."""
        return any(beam.start <= self.clock() < beam.end for beam in self.beams)

    def named(self, what: str) -> Iterator[Event]:
        """The events of one kind."""
        return (event for event in self.events if event.what == what)

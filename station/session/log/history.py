"""The state of a session: a fold over its events.

Pure functions; undo and redo only compute where a pointer goes. A slot is a pointer to one event of a page. Slots of a
page itself (`capture`, `label`) name the current scan and what holds for the page; slots on an event (`restore@5`,
`accept@5`) name what was made of it. A page's state is found by walking from its current scan, so that the scan of an
earlier capture comes back with all that was made of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

from station.session.log.events import VOLUME, Event
from station.session.log.facts import VALUES, Decisions
from station.session.log.results import QualityCheck, Restored
from station.session.terms.parts import PAGE, RESTORE, STEM, VERDICT

CAPTURE = "capture"
OPERATORS = frozenset({"capture", "decision"})  # kinds of events that undo takes back, one at a time


@dataclass(frozen=True)
class Restoration:
    """A run of the restoration: its event, and what it found."""

    event: Event
    result: Restored

    @property
    def edits(self) -> Any:
        """The corrections that it was made with, as they were recorded; None without any."""
        return self.event.parameters.get("edits")

    @property
    def seconds(self) -> float:
        """The seconds that it took; 0 where they were not recorded."""
        seconds = self.event.facts.get("seconds")
        return float(seconds.get("total", 0.0)) if isinstance(seconds, dict) else 0.0

    def file(self, part: str, ending: str = ".png") -> str | None:
        """The name of a file of a part; None where it has none.

        ending: what follows the stem, as `-coverage.png`.
        """
        name = STEM + (f"-{part}" if self.result.is_split and part != PAGE else "") + ending
        return name if name in self.event.files else None


@dataclass(frozen=True)
class Page:
    """A page as its pointers show it.

    capture    the current scan; None after its only shot was undone.
    runs       name of the stage → its current run on that scan.
    decisions  name → current decision on the page or on that scan.
    """

    number: int
    capture: Event | None
    runs: Mapping[str, Event]
    decisions: Mapping[str, Event]

    @cached_property
    def decided(self) -> Decisions:
        """What was decided."""
        return Decisions(**{name: event.value for name, event in self.decisions.items() if name in VALUES})

    @property
    def restoration(self) -> Restoration | None:
        """Its current restoration."""
        return None if (run := self.runs.get(RESTORE)) is None else restoration_of(run)

    @property
    def restored(self) -> Restored | None:
        """The result of its current restoration."""
        return None if (run := self.runs.get(RESTORE)) is None else run.restored

    @property
    def quality(self) -> QualityCheck | None:
        """The result of its current quality check, without the same pages that an operator keeps."""
        checked = None if (run := self.runs.get(VERDICT)) is None else run.checked
        return checked and checked.keeping(self.decided.keep_both)

    @property
    def state(self) -> str:
        """`accepted` or `again`, as was decided on its scan; else `restored` or `new`."""
        if self.decided.accept is not None:
            return "accepted" if self.decided.accept else "again"
        return "restored" if RESTORE in self.runs else "new"

    @property
    def level(self) -> str:
        """The level of its quality check, empty without one."""
        return "" if self.quality is None else self.quality.level

    @property
    def order(self) -> float:
        """Its place among the pages, as was decided, else its number."""
        return float(self.number if self.decided.position is None else self.decided.position)


@dataclass(frozen=True)
class CapturedPage(Page):
    """A page with a scan."""

    capture: Event


@dataclass(frozen=True)
class History:
    """All events of a session, and where each pointer stands.

    events    in order; event n is at n − 1.
    pointers  page → slot → event number; absent where the pointer names nothing.
    done      events of the operator that undo would take back, the next one last.
    undone    those that redo would bring back, the next one last.
    """

    events: tuple[Event, ...] = ()
    pointers: Mapping[int, Mapping[str, int]] = field(default_factory=dict)
    done: tuple[int, ...] = ()
    undone: tuple[int, ...] = ()

    def event(self, number: int) -> Event:
        """The event of a number."""
        return self.events[number - 1]

    def current(self, page: int, slot: str) -> Event | None:
        """The event that a slot of a page names."""
        number = self.pointers.get(page, {}).get(slot)
        return None if number is None else self.event(number)

    def page(self, number: int) -> Page:
        """A page as its pointers show it."""
        slots = {slot: self.event(at) for slot, at in self.pointers.get(number, {}).items()}
        capture = slots.get(CAPTURE)
        steps = [event for slot, event in slots.items() if slot != CAPTURE and event.on is None]
        steps += _continuations(capture, slots.values()) if capture else []
        runs, decisions = _of_kind("stage", steps), _of_kind("decision", steps)
        return CapturedPage(number, capture, runs, decisions) if capture else Page(number, None, runs, decisions)

    @property
    def volume(self) -> Page:
        """The volume as its pointers show it: a page of decisions."""
        return self.page(VOLUME)

    def captured(self, number: int) -> CapturedPage | None:
        """A page as its pointers show it; None without a scan."""
        page = self.page(number)
        return page if isinstance(page, CapturedPage) else None

    def pages(self) -> Iterator[CapturedPage]:
        """Yield pages with a scan in the order of the volume: by `position`, else by number."""
        pages = (self.page(number) for number in self.pointers if number != VOLUME)
        captured = (page for page in pages if isinstance(page, CapturedPage))
        return iter(sorted(captured, key=lambda page: (page.order, page.number)))

    def shots(self, capture: Event) -> tuple[int, ...]:
        """The number of a scan, and of those that it replaced, back to the first."""
        found, shot = list[int](), capture
        while shot.slot == CAPTURE:
            found.append(shot.number)
            if shot.parent is None:
                break
            shot = self.event(shot.parent)
        return tuple(found)

    def free_page(self) -> int:
        """The number of the next new page: the first that has no scan."""
        return next(n for n in range(1, len(self.pointers) + 2) if CAPTURE not in self.pointers.get(n, ()))


def restoration_of(event: Event) -> Restoration:
    """Return a run of the restoration. Raises ValueError for another event."""
    if event.restored is None:
        raise ValueError(f"event {event.number} is not a restoration")
    return Restoration(event, event.restored)


def extended(history: History, event: Event) -> History:
    """Return the history with one more event.

    The other pages' pointers are not copied, so that a long session stays fast. Raises ValueError when its number is
    not the next one, or a reference is invalid.
    """
    known, done, undone = list(history.events), list(history.done), list(history.undone)
    slots = dict(history.pointers.get(event.page, {}))
    _follow(event, known, slots, done, undone)
    pointers = {**history.pointers, event.page: MappingProxyType(slots)}
    return History(tuple(known), MappingProxyType(pointers), tuple(done), tuple(undone))


def folded(events: Iterable[Event]) -> History:
    """Return the history of the events.

    Raises ValueError when their numbers do not count on, or a reference is invalid.
    """
    known, done, undone = list[Event](), list[int](), list[int]()
    pointers = dict[int, dict[str, int]]()
    for event in events:
        _follow(event, known, pointers.setdefault(event.page, {}), done, undone)
    return History(tuple(known), _frozen(pointers), tuple(done), tuple(undone))


def undo_target(history: History) -> Event | None:
    """Return the operator's event that undo takes back, or None."""
    return history.event(history.done[-1]) if history.done else None


def redo_target(history: History) -> Event | None:
    """Return the operator's event that redo brings back, or None."""
    return history.event(history.undone[-1]) if history.undone else None


def earlier(history: History, page: int, slot: str) -> Event | None:
    """The event that a slot named before its current one."""
    now = history.current(page, slot)
    return None if now is None or now.parent is None else history.event(now.parent)


def later(history: History, page: int, slot: str) -> Event | None:
    """The newest event of a slot that followed its current one."""
    now = history.current(page, slot)
    parent = None if now is None else now.number
    own = (e for e in reversed(history.events) if (e.page, e.slot, e.parent) == (page, slot, parent))
    return next((event for event in own if event.kind != "move"), None)


def _follow(event: Event, known: list[Event], slots: dict[str, int], done: list[int], undone: list[int]) -> None:
    """Append an event, and apply it to its page's slots and the undo and redo stacks."""
    if event.number != len(known) + 1:
        raise ValueError(f"event {event.number} follows event {len(known)}")
    known.append(event)
    if event.kind != "move":
        slots[event.slot] = event.number
        if event.kind in OPERATORS:
            done.append(event.number)
            undone.clear()
        return
    to, reason = event.facts.get("to"), event.facts.get("reason")
    if to is None:
        slots.pop(event.slot, None)
    elif isinstance(to, int) and 0 < to < event.number and _is_of(known[to - 1], event):
        slots[event.slot] = to
    else:
        raise ValueError(f"event {event.number} moves a pointer to {to!r}, which is not an event of its slot")
    if reason == "undo" and done:
        undone.append(done.pop())
    elif reason == "redo" and undone:
        done.append(undone.pop())


def _is_of(target: Event, move: Event) -> bool:
    return (target.page, target.slot) == (move.page, move.slot) and target.kind != "move"


def _continuations(start: Event, events: Iterable[Event]) -> list[Event]:
    """The events that continue one event, those that continue these, and so on."""
    events, found = list(events), [start]
    for one in found:  # which grows
        found += [event for event in events if event.on == one.number]
    return found[1:]


def _of_kind(kind: str, events: Iterable[Event]) -> Mapping[str, Event]:
    return MappingProxyType({event.name: event for event in events if event.kind == kind})


def _frozen(pointers: dict[int, dict[str, int]]) -> Mapping[int, Mapping[str, int]]:
    return MappingProxyType({page: MappingProxyType(slots) for page, slots in pointers.items()})

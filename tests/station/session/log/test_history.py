"""Pages and pointers as a fold over events."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.session.log.events import VOLUME, Event, slot_of
from station.session.log.history import History, earlier, extended, folded, later, redo_target, undo_target


def event(history: History, kind: str, slot: str, page: int = 1, **facts: object) -> Event:
    now = history.current(page, slot)
    parent = None if now is None else now.number
    return Event(len(history.events) + 1, page, kind, slot, parent, "t", "s", facts)  # type: ignore[arg-type]


def grown(history: History, kind: str, slot: str, page: int = 1, **facts: object) -> History:
    return extended(history, event(history, kind, slot, page, **facts))


def undone(history: History) -> History:
    step = undo_target(history)
    return history if step is None else grown(history, "move", step.slot, step.page, to=step.parent, reason="undo")


def redone(history: History) -> History:
    step = redo_target(history)
    return history if step is None else grown(history, "move", step.slot, step.page, to=step.number, reason="redo")


def shot(history: History, page: int = 1) -> History:
    return grown(history, "capture", "capture", page)


def test_what_was_made_of_a_scan_returns_with_it():
    history = shot(History())
    first = history.event(1)
    history = grown(history, "stage", slot_of("restore", first))
    restored = history.event(2)
    history = grown(history, "stage", slot_of("verdict", restored))
    history = grown(history, "decision", slot_of("accept", first), value=True)
    history = grown(history, "decision", "label", value="1r")
    history = shot(history)
    page = history.page(1)
    assert (page.capture.number, dict(page.runs), list(page.decisions)) == (6, {}, ["label"])
    late = grown(history, "stage", slot_of("restore", first))  # a run that ends after the page was shot again
    assert dict(late.page(1).runs) == {}
    page = undone(late).page(1)
    assert page.capture == first
    assert {name: run.number for name, run in page.runs.items()} == {"restore": 7}
    assert (page.decided.accept, page.decided.label, page.decided.note) == (True, "1r", "")


def test_runs_of_a_stage_have_an_order_of_their_own():
    history = shot(History())
    slot = slot_of("restore", history.event(1))
    history = grown(grown(history, "stage", slot), "stage", slot)
    assert (earlier(history, 1, slot).number, later(history, 1, slot)) == (2, None)
    assert undo_target(history).number == 1  # the operator's last step was the shot
    history = grown(history, "move", slot, to=2, reason="stage")
    assert (history.page(1).runs["restore"].number, later(history, 1, slot).number) == (2, 3)


def test_the_order_of_the_pages_and_the_next_free_one():
    history = History()
    for page in (1, 2, 3):
        history = shot(history, page)
    history = grown(history, "decision", "position", 3, value=1.5)
    history = grown(history, "decision", "note", VOLUME, value="of the volume")
    assert [page.number for page in history.pages()] == [1, 3, 2]
    assert history.free_page() == 4
    history = undone(undone(undone(history)))
    assert [page.number for page in history.pages()] == [1, 2]
    assert history.free_page() == 3


STEPS = st.lists(st.tuples(st.sampled_from(["do", "stage", "undo", "redo"]), st.integers(1, 3), st.integers(0, 2)))


@given(STEPS)
def test_undo_and_redo_are_those_of_two_stacks(steps):
    """The oracle keeps whole states of the operator's slots on two stacks."""
    history, state = History(), dict[tuple[int, str], int]()
    past, future = list[dict[tuple[int, str], int]](), list[dict[tuple[int, str], int]]()
    for kind, page, choice in steps:
        if kind == "do":
            slot = ("label", "note", "capture")[choice]
            history = grown(history, "capture" if slot == "capture" else "decision", slot, page)
            past, future = [*past, dict(state)], []
            state = {**state, (page, slot): len(history.events)}
        elif kind == "stage":
            history = grown(history, "stage", "words", page)
        elif kind == "undo":
            history = undone(history)
            if past:
                future, state = [*future, state], past.pop()
        else:
            history = redone(history)
            if future:
                past, state = [*past, state], future.pop()
        reported = {(p, s): n for p, slots in history.pointers.items() for s, n in slots.items() if s != "words"}
        assert reported == state
    assert folded(history.events) == history


@pytest.mark.parametrize("to", [9, 1, "1", True])
def test_a_move_to_no_event_of_its_slot_is_refused(to):
    history = shot(History(), 2)
    with pytest.raises(ValueError, match="not an event of its slot"):
        grown(history, "move", "capture", 1, to=to)


def test_a_gap_is_refused():
    events = [Event(n, 1, "decision", "note", None, "t", "s") for n in (1, 3)]
    assert [b.number - a.number for a, b in pairwise(events)] == [2]
    with pytest.raises(ValueError, match="event 3 follows event 1"):
        folded(events)

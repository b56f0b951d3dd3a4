"""The steps that a session records: a scan, a stage's run, a decision, undo and redo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from station.session.log.events import VOLUME, Event, slot_of
from station.session.log.history import earlier, later, redo_target, undo_target
from station.session.log.store import Writer


def record_run(
    writer: Writer,
    stage: str,
    on: Event,
    *,
    parameters: Mapping[str, Any],
    result: Mapping[str, Any],
    files: Path | None = None,
    facts: Mapping[str, Any] | None = None,
    others: Sequence[Event] = (),
) -> Event:
    """Record a stage's run on the result of another event, and return its event.

    parameters  all that the run depends on in addition to its input; `reproduce` uses them.
    result      JSON values that follow from input and parameters: `reproduce` must find the same.
    files       a folder of `staging` with the run's files, which `reproduce` must write again to the byte.
    facts       what does not follow from them: seconds, memory.
    others      further events that it read.
    """
    recorded = {"parameters": dict(parameters), "result": dict(result), **(facts or {})}
    return writer.record("stage", slot_of(stage, on), page=on.page, facts=recorded, inputs=[on, *others], files=files)


def decide(writer: Writer, name: str, value: object, *, page: int = VOLUME, on: Event | None = None) -> Event:
    """Record a decision on a page, or `on` its scan; return its event.

    It has a name and a JSON value.
    """
    return writer.record("decision", slot_of(name, on), page=page, facts={"value": value})


def move(writer: Writer, page: int, slot: str, to: Event | None, *, reason: str) -> Event:
    """Let a slot of a page name another of its events, or none.

    Returns the event of that.
    """
    facts = {"to": None if to is None else to.number, "reason": reason}
    return writer.record("move", slot, page=page, facts=facts)


def undo(writer: Writer) -> Event | None:
    """Take back the operator's last step.

    Returns that step, None without one.
    """
    step = undo_target(writer.history)
    if step is not None:
        before = None if step.parent is None else writer.history.event(step.parent)
        move(writer, step.page, step.slot, before, reason="undo")
    return step


def redo(writer: Writer) -> Event | None:
    """Bring back the step that was taken back last.

    Returns it, None without one.
    """
    step = redo_target(writer.history)
    if step is not None:
        move(writer, step.page, step.slot, step, reason="redo")
    return step


def undo_run(writer: Writer, page: int, stage: str) -> Event | None:
    """Let a page's stage name the run before its current one, or none.

    Returns the run that was current, if any.
    """
    run = writer.history.page(page).runs.get(stage)
    if run is not None:
        move(writer, page, run.slot, earlier(writer.history, page, run.slot), reason="stage")
    return run


def redo_run(writer: Writer, page: int, stage: str) -> Event | None:
    """Let a page's stage name the run after its current one.

    Returns that run, None without one.
    """
    shown = writer.history.page(page)
    for on in (shown.capture, *shown.runs.values()):
        run = None if on is None else later(writer.history, page, slot_of(stage, on))
        if run is not None:
            move(writer, page, run.slot, run, reason="stage")
            return run
    return None

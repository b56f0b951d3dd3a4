"""Make corrections, undo and redo them.

A restoration that was made with the same corrections is shown again; nothing is computed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from restore import BadInput
from station.session import steps
from station.session.corrections import effective_edits, is_of, rules_of
from station.session.events import VOLUME, Event, slot_of
from station.session.parts import RESTORE
from station.session.rules import EDITS, MAX_RULES, RULES, Rule, Scope, recorded
from station.session.steps import decide, move
from station.session.store import Writer


def correct(writer: Writer, page: int, edits: Mapping[str, Any] | None) -> Event:
    """Record the corrections of a page in place of its present ones.

    edits: the fields that are given, as `PageEdits.given`; None removes all.
    Returns the event. Raises BadInput for invalid corrections, and for a page without a scan, OSError.
    """
    capture = writer.history.page(page).capture
    if capture is None:
        raise BadInput(f"page {page} has no scan", "capture it, then correct it")
    value = None if edits is None else recorded(edits)
    event = decide(writer, EDITS, value, page=page, on=capture)
    show_fitting(writer, event)
    return event


def add_rule(writer: Writer, scope: Scope, edits: Mapping[str, Any]) -> Event:
    """Record one more rule, which wins over those before it.

    Raises BadInput, OSError.
    """
    rules = [rule.as_json() for rule in rules_of(writer.session)]
    if len(rules) >= MAX_RULES:
        raise BadInput(f"the volume has {len(rules)} rules, as many as it can", "correct the pages that are left")
    number = len(writer.history.events) + 1
    rule = Rule(id=number, scope=scope, edits=recorded(edits))
    event = decide(writer, RULES, [*rules, rule.as_json()])
    show_fitting(writer)
    return event


def undo(writer: Writer) -> Event | None:
    """Undo the operator's last step, and show the restorations that fit."""
    step = steps.undo(writer)
    show_fitting(writer, step)
    return step


def redo(writer: Writer) -> Event | None:
    """Redo the step undone last, and show the restorations that fit."""
    step = steps.redo(writer)
    show_fitting(writer, step)
    return step


def show_fitting(writer: Writer, step: Event | None = None) -> None:
    """Show the restorations that were made with the present corrections.

    Nothing is computed.

    step: that was taken back or brought back; one that corrects nothing changes no page.
    """
    if step is not None and step.name not in (EDITS, RULES):
        return
    rules = rules_of(writer.session)
    pages = list(writer.history.pages()) if step is None or step.page == VOLUME else [writer.history.page(step.page)]
    runs = _runs(writer)
    for page in pages:
        made = [] if page.capture is None else runs.get(slot_of(RESTORE, page.capture), [])
        if len(made) < 2:  # no other one can be shown
            continue
        edits = effective_edits(writer.session, page, rules)
        if RESTORE in page.runs and is_of(page.runs[RESTORE], edits):
            continue
        fitting = next((run for run in reversed(made) if is_of(run, edits)), None)
        if fitting is not None:
            move(writer, page.number, fitting.slot, fitting, reason="stage")


def _runs(writer: Writer) -> dict[str, list[Event]]:
    """Return slot → its restorations, the latest last.

    A slot names its scan, which is of one page.
    """
    found = dict[str, list[Event]]()
    for event in writer.history.events:
        if event.kind == "stage" and event.name == RESTORE:
            found.setdefault(event.slot, []).append(event)
    return found

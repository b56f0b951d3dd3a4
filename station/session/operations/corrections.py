"""Make corrections, undo and redo them.

A restoration that was made with the same corrections is shown again; nothing is computed.
"""

from __future__ import annotations

from restore import BadInput, PageEdits
from station.session.corrections.layers import rules_of
from station.session.derivation.fitting import show_fitting
from station.session.log import steps
from station.session.log.events import Event
from station.session.log.steps import decide
from station.session.log.store import Writer
from station.session.terms.rules import EDITS, MAX_RULES, RULES, Rule, Scope, recorded


def correct(writer: Writer, page: int, edits: PageEdits | None) -> Event:
    """Record the corrections of a page in place of its present ones.

    edits: the fields that are given are recorded; None removes all.
    Returns the event. Raises BadInput for invalid corrections, and for a page without a scan, OSError.
    """
    capture = writer.history.page(page).capture
    if capture is None:
        raise BadInput(f"page {page} has no scan", "capture it, then correct it")
    value = None if edits is None else recorded(edits)
    event = decide(writer, EDITS, value, page=page, on=capture)
    show_fitting(writer, event)
    return event


def add_rule(writer: Writer, scope: Scope, edits: PageEdits) -> Event:
    """Record one more rule, which wins over those before it.

    Raises BadInput, OSError.
    """
    rules = [rule.as_json() for rule in rules_of(writer.session)]
    if len(rules) >= MAX_RULES:
        raise BadInput(f"the volume has {len(rules)} rules, as many as it can", "correct the pages that are left")
    number = len(writer.history.events) + 1
    recorded(edits)
    rule = Rule(id=number, scope=scope, edits=edits)
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

"""Make corrections, undo and redo steps.

A restoration that was made with the same corrections is shown again; nothing is computed.
"""

from __future__ import annotations

from restore import BadInput, PageEdits
from station.errors import UsageError
from station.session.corrections.layers import own_edits, rules_of
from station.session.corrections.scope import PlannedRule, pages_of
from station.session.derivation.fitting import show_fitting
from station.session.log import steps
from station.session.log.events import Event
from station.session.log.history import CAPTURE
from station.session.log.steps import decide
from station.session.log.store import Session, Writer
from station.session.operations.tags import check_tag, corrections_tag, rules_tag
from station.session.terms.rules import EDITS, MAX_RULES, RULES, Rule, Scope, recorded


class NotForMany(UsageError):
    """Raised for a field that fits no other scan."""

    def __init__(self, field: str) -> None:
        super().__init__(f"{field} fits no other scan", "set it on each page")
        self.field = field


def correct(writer: Writer, page: int, edits: PageEdits | None, *, expected: int | None = None) -> Event | None:
    """Record the corrections of a page in place of its present ones.

    edits: the fields that are given are recorded; None removes all. expected: the tag of what they were made from.
    Returns the event, None for those that the page has. Raises BadInput for invalid corrections, and for a page without
    a scan, Stale, OSError.
    """
    captured = writer.history.captured(page)
    if captured is None:
        raise BadInput(f"page {page} has no scan", "capture it, then correct it")
    value = None if edits is None else recorded(edits)
    tag = corrections_tag(writer.session, captured)
    check_tag(expected, tag, f"page {page} was corrected or captured again meanwhile")
    if (value or {}) == own_edits(writer.session, captured).given():
        return None
    event = decide(writer, EDITS, value, page=page, on=captured.capture)
    show_fitting(writer, event)
    return event


def plan_rule(session: Session, scope: Scope, edits: PageEdits) -> PlannedRule:
    """Return a rule with the pages that it would be on; nothing is recorded.

    Raises UsageError for fields and scans that a rule cannot have.
    """
    parts = [f"parts.{name}.outline" for name, part in edits.parts.items() if part.outline]
    for name in [one for one in ("spine", "scan") if getattr(edits, one) is not None] + parts:
        raise NotForMany(name)
    events = session.history.events
    for number in scope.captures if isinstance(scope.captures, list) else ():
        if not 0 < number <= len(events) or events[number - 1].slot != CAPTURE:
            raise UsageError(f"event {number} is not a scan", "name scans of this session")
    recorded(edits)
    rule = Rule(id=len(events) + 1, scope=scope, edits=edits)
    return PlannedRule(scope, edits, pages_of(session, rule), rules_tag(session))


def apply_rule(writer: Writer, planned: PlannedRule) -> Event:
    """Record a rule as it was planned.

    Raises Stale where another rule was recorded meanwhile, BadInput, OSError.
    """
    check_tag(planned.tag, rules_tag(writer.session), "another rule was recorded meanwhile")
    return add_rule(writer, planned.scope, planned.edits)


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

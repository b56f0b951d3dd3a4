"""Tags of what an operator sees: the number of the last event that it follows from.

A change that was made from what no longer stands is refused.
"""

from __future__ import annotations

from station.errors import StationError
from station.session.corrections.layers import rules_of
from station.session.leaves.leaf import MISSING, ORDER
from station.session.log.history import CapturedPage
from station.session.log.store import Session
from station.session.terms.about import ABOUT
from station.session.terms.labels import LABELS
from station.session.terms.rules import EDITS, RULES


class Stale(StationError):
    """Raised for a change of what was changed meanwhile; nothing was recorded."""

    def __init__(self, text: str) -> None:
        super().__init__(text, "look at it as it is now, then change it again")


def check_tag(expected: int | None, now: int, text: str) -> None:
    """Raise Stale unless a change was made from what stands.

    expected: tag of what it was made from; None for whatever stands.
    """
    if expected is not None and expected != now:
        raise Stale(text)


def arrangement_tag(session: Session) -> int:
    """Return the tag of order, runs and missing leaves; 0 for none."""
    return _last(session, ORDER, LABELS, MISSING)


def description_tag(session: Session) -> int:
    """Return the tag of the description of the volume; 0 for none."""
    return _last(session, ABOUT)


def rules_tag(session: Session) -> int:
    """Return the tag of the rules of the volume; 0 for none."""
    return _last(session, RULES)


def corrections_tag(session: Session, page: CapturedPage) -> int:
    """Return the tag of a page's own corrections.

    The scan's own number where it has none: a page that is captured again has another tag. A rule that took the place
    of some of them has one, too.
    """
    event = page.decisions.get(EDITS)
    if event is None:
        return page.capture.number
    over = (rule.id for rule in rules_of(session) if rule.is_over(event.number, session.history.shots(page.capture)))
    return max([event.number, *over])


def _last(session: Session, *names: str) -> int:
    decisions = session.history.volume.decisions
    return max((decisions[name].number for name in names if name in decisions), default=0)

"""The corrections of a page, each with its source, and their tag."""

from __future__ import annotations

from typing import Any

from restore import Settings
from station.console.faults import ConsoleFault
from station.session import Session
from station.session.corrections.layers import effective_edits, layers_of, own_edits, rules_of
from station.session.derivation.parameters import needs_restoration
from station.session.log.current import preset_of
from station.session.log.history import CapturedPage
from station.session.terms.rules import EDITS


def shown_page(session: Session, number: int) -> CapturedPage:
    """Return a page with a scan. Raises ConsoleFault."""
    page = session.history.captured(number)
    if page is None:
        raise ConsoleFault("no_page", f"the session has no page {number}")
    return page


def tag_of(session: Session, page: CapturedPage) -> int:
    """Return the number of the event that a page's own corrections are of.

    The scan's own number where it has none: a page that is captured again has another tag. A rule that took the place
    of some of them has one, too.
    """
    capture, event = page.capture, page.decisions.get(EDITS)
    if event is None:
        return capture.number
    over = (rule.id for rule in rules_of(session) if rule.is_over(event.number, session.history.shots(capture)))
    return max([event.number, *over])


def corrections_of(session: Session, number: int) -> dict[str, Any]:
    """Return the corrections of a page as JSON values. Raises ConsoleFault."""
    page = shown_page(session, number)
    run, preset = page.restoration, preset_of(session)
    sources = [{"source": source, "edits": edits.given()} for source, edits in layers_of(session, page)]
    return {
        "page": number,
        "capture": page.capture.number,
        "tag": tag_of(session, page),
        "edits": own_edits(session, page).given() or None,
        "effective": effective_edits(session, page),
        "sources": sources,
        "preset_layout": str(preset.layout),
        "preset_shading": Settings.model_validate(preset.settings).shading,
        "outdated": needs_restoration(session, page),
        "restore": None if run is None else run.event.number,
        "restored": None if run is None else run.edits,
        "parts": {} if run is None else {part: leaf.page_mm for part, leaf in run.result.leaves.items()},
    }

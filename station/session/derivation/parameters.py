"""What a page is restored with, and whether it has been."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from station.session.corrections.layers import effective_edits, rules_of
from station.session.log.current import preset_of
from station.session.log.events import Event
from station.session.log.history import CapturedPage, Page
from station.session.log.store import Session
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset
from station.session.terms.rules import EDITS, RULES, Rule


def parameters_of(session: Session, page: CapturedPage, preset: Preset | None = None) -> dict[str, Any]:
    """Return the parameters of a restoration of a page as it is now.

    preset: in place of the session's own.
    """
    captured = page.capture.captured
    parameters = (preset or preset_of(session)).parameters(captured.scale, **captured.reading)
    edits = effective_edits(session, page)
    return parameters if edits is None else {**parameters, "edits": edits}


def inputs_of(session: Session, page: Page) -> list[Event]:
    """The decisions that a restoration of a page follows from, besides its scan."""
    decisions = page.decisions.get(EDITS), session.history.volume.decisions.get(RULES)
    return [event for event in decisions if event is not None] if effective_edits(session, page) else []


def needs_restoration(session: Session, page: Page, rules: Sequence[Rule] | None = None) -> bool:
    """Whether a page has a scan and no restoration of it as it is corrected now."""
    if page.capture is None:
        return False
    return page.restoration is None or page.restoration.edits != effective_edits(session, page, rules)


def outdated_pages(session: Session) -> list[int]:
    """The numbers of the pages that were corrected since they were restored."""
    rules = rules_of(session)
    pages = (page for page in session.history.pages() if RESTORE in page.runs)
    return [page.number for page in pages if needs_restoration(session, page, rules)]

"""The corrections of a page, each with its source, and their tag."""

from __future__ import annotations

from typing import Any

from restore import Settings
from station.console.faults import ConsoleFault
from station.session import Session
from station.session.derivation.parameters import needs_restoration
from station.session.leaves.views import corrections_view
from station.session.log.current import preset_of
from station.session.log.history import CapturedPage
from station.session.operations.tags import corrections_tag


def shown_page(session: Session, number: int) -> CapturedPage:
    """Return a page with a scan. Raises ConsoleFault."""
    page = session.history.captured(number)
    if page is None:
        raise ConsoleFault("no_page", f"the session has no page {number}")
    return page


def corrections_of(session: Session, number: int) -> dict[str, Any]:
    """Return the corrections of a page as JSON values. Raises ConsoleFault."""
    page = shown_page(session, number)
    run, preset = page.restoration, preset_of(session)
    found = corrections_view(session, page)
    sources = [{"source": source, "edits": edits.given()} for source, edits in found.layers]
    return {
        "page": number,
        "capture": page.capture.number,
        "tag": corrections_tag(session, page),
        "edits": found.own.given() or None,
        "effective": found.effective,
        "sources": sources,
        "preset_layout": str(preset.layout),
        "preset_shading": Settings.model_validate(preset.settings).shading,
        "outdated": needs_restoration(session, page),
        "restore": None if run is None else run.event.number,
        "restored": None if run is None else run.edits,
        "parts": {} if run is None else {part: leaf.page_mm for part, leaf in run.result.leaves.items()},
    }

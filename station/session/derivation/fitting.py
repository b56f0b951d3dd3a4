"""Show the restorations that fit the present corrections; nothing is computed."""

from __future__ import annotations

from station.session.corrections.layers import effective_edits, rules_of
from station.session.log.events import VOLUME, Event, slot_of
from station.session.log.history import restoration_of
from station.session.log.steps import move
from station.session.log.store import Writer
from station.session.terms.parts import RESTORE
from station.session.terms.rules import EDITS, RULES


def show_fitting(writer: Writer, step: Event | None = None) -> None:
    """Show the restorations that were made with the present corrections.

    Nothing is computed.

    step: that was taken back or brought back; one that corrects nothing changes no page.
    """
    if step is not None and step.name not in (EDITS, RULES):
        return
    rules = rules_of(writer.session)
    runs = _runs(writer)
    pages = writer.history.pages() if step is None or step.page == VOLUME else [writer.history.captured(step.page)]
    for page in list(pages):
        made = [] if page is None else runs.get(slot_of(RESTORE, page.capture), [])
        if page is None or len(made) < 2:  # no other one can be shown
            continue
        edits = effective_edits(writer.session, page, rules)
        if page.restoration is not None and page.restoration.edits == edits:
            continue
        fitting = next((run for run in reversed(made) if restoration_of(run).edits == edits), None)
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

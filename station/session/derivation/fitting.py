"""Show the restorations that fit the present corrections; nothing is computed."""

from __future__ import annotations

from station.session.corrections.layers import effective_edits, rules_of
from station.session.derivation.parameters import is_of
from station.session.log.events import VOLUME, Event, slot_of
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

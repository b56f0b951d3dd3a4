"""Corrections that are taken back and brought back: pointers move, and nothing is computed again."""

from __future__ import annotations

import pytest

from restore import BadInput, PageEdits
from station.session import add_rule, add_scan, correct, open_session, redo, undo
from station.session.derivation.fitting import show_fitting
from station.session.derivation.parameters import needs_restoration, parameters_of
from station.session.log.steps import decide, record_run
from station.session.terms.parts import RESTORE
from station.session.terms.rules import Scope, edits_of


@pytest.fixture
def writer(volume, tiny_scan):
    """A session of two restored pages."""
    with open_session(volume) as opened:
        for _ in range(2):
            add_scan(opened, tiny_scan, facts={})
        restore(opened)
        yield opened


def restore(writer) -> int:
    """Record a restoration of each page that needs one, and return how many there were."""
    pages = [page for page in writer.history.pages() if needs_restoration(writer.session, page)]
    for page in pages:
        parameters = parameters_of(writer.session, page)
        record_run(writer, RESTORE, page.capture, parameters=parameters, result={"n": len(writer.history.events)})
    return len(pages)


def shown(writer):
    return [page.runs[RESTORE].number for page in writer.history.pages()]


TURNED = edits_of({"parts": {"page": {"turn": 1}}})


def test_undo_and_redo_of_a_correction_show_what_was_restored(writer):
    before = shown(writer)
    correct(writer, 1, TURNED)
    assert restore(writer) == 1
    after = shown(writer)
    undo(writer)
    assert (shown(writer), restore(writer)) == (before, 0)
    redo(writer)
    assert (shown(writer), restore(writer)) == (after, 0)
    correct(writer, 1, None)
    assert (shown(writer), restore(writer)) == (before, 0)
    last = writer.history.events[-1]
    assert (last.kind, last.facts) == ("move", {"to": before[0], "reason": "stage"})


def test_undo_of_a_rule_shows_the_restorations_of_all_its_pages(writer):
    before = shown(writer)
    add_rule(writer, Scope(), TURNED)
    assert restore(writer) == 2
    undo(writer)
    assert (shown(writer), restore(writer)) == (before, 0)


def test_other_steps_move_no_restoration(writer):
    correct(writer, 1, TURNED)
    decide(writer, "label", "3", page=1)
    count = len(writer.history.events)
    undo(writer)
    assert len(writer.history.events) == count + 1


def test_a_page_that_is_captured_again_begins_without_and_its_corrections_come_back(writer, tiny_scan):
    correct(writer, 1, TURNED)
    add_scan(writer, tiny_scan, page=1, facts={})
    assert "edits" not in writer.history.page(1).decisions
    undo(writer)
    assert writer.history.page(1).decided.edits == TURNED


def test_corrections_that_cannot_be_change_nothing(writer):
    count = len(writer.history.events)
    for page, edits in ((1, PageEdits.model_construct(layout="sideways")), (7, TURNED)):
        with pytest.raises(BadInput):
            correct(writer, page, edits)
    assert len(writer.history.events) == count


def test_nothing_is_recorded_where_the_shown_restorations_fit(writer):
    before = len(writer.history.events)
    show_fitting(writer)
    assert len(writer.history.events) == before

"""A change that was made from what no longer stands is refused, and nothing is recorded."""

from __future__ import annotations

from functools import partial

import pytest

from restore import PageEdits
from station.session import add_rule, add_scan, correct, open_session
from station.session.leaves.leaf import leaves_of
from station.session.operations.arrangement import change_leaf, mark_missing, move_leaves, number_from, set_runs
from station.session.operations.corrections import apply_rule, plan_rule
from station.session.operations.description import describe
from station.session.operations.tags import Stale, arrangement_tag, corrections_tag, description_tag
from station.session.terms.about import About
from station.session.terms.labels import Run
from station.session.terms.parts import PARTS
from station.session.terms.rules import Scope, edits_of

TURNED = edits_of({"parts": {part: {"turn": 1} for part in PARTS}})


@pytest.fixture
def writer(volume, tiny_scan):
    """A session of two pages."""
    with open_session(volume) as opened:
        for _ in range(2):
            add_scan(opened, tiny_scan, facts={})
        yield opened


CHANGES = {
    "order": (partial(move_leaves, moved=["2"], before="1"), partial(move_leaves, moved=["2"], before=None)),
    "run": (partial(number_from, name="2", run=Run(style="roman")), partial(number_from, name="2", run=None)),
    "runs": (partial(set_runs, runs=[Run(style="roman")]), partial(set_runs, runs=[])),
    "missing": (partial(mark_missing, name="2", labels=["2"]), partial(mark_missing, name="2", labels=[])),
    "left out": (partial(change_leaf, name="1", left_out=True), partial(change_leaf, name="1", left_out=False)),
    "about": (partial(describe, about=About(title="A")), partial(describe, about=About(title="B"))),
}


@pytest.mark.parametrize(("first", "second"), CHANGES.values(), ids=CHANGES.keys())
def test_the_second_of_two_changes_from_the_same_state_is_refused(writer, first, second):
    assert first(writer, expected=0) == writer.history.events[-1]
    before = len(writer.history.events)
    assert first(writer, expected=before) is None  # which changes nothing
    with pytest.raises(Stale, match="meanwhile"):
        second(writer, expected=0)
    assert len(writer.history.events) == before
    assert second(writer, expected=before) is not None
    assert first(writer) is not None  # whatever stands


def test_the_tag_of_corrections_is_that_of_the_latest_or_of_the_scan(writer):
    def tag():
        return corrections_tag(writer.session, writer.history.captured(1))

    scan = writer.history.captured(1).capture
    assert tag() == scan.number
    corrected = correct(writer, 1, TURNED, expected=scan.number)
    assert tag() == corrected.number
    assert correct(writer, 1, TURNED, expected=tag()) is None
    with pytest.raises(Stale, match="page 1 was corrected or captured again meanwhile"):
        correct(writer, 1, None, expected=scan.number)
    rule = add_rule(writer, Scope(captures=[scan.number], over=[scan.number]), TURNED)
    assert tag() == rule.number


def test_a_rule_is_refused_after_another_one(writer):
    planned = plan_rule(writer.session, Scope(), TURNED)
    assert planned.pages == {1: (), 2: ()}
    apply_rule(writer, planned)
    with pytest.raises(Stale, match="another rule"):
        apply_rule(writer, planned)
    assert len(writer.history.volume.decided.rules) == 1


def test_other_steps_leave_the_tags(writer):
    correct(writer, 1, PageEdits(layout="whole"))
    assert (arrangement_tag(writer.session), description_tag(writer.session)) == (0, 0)
    assert [leaf.tag for leaf in leaves_of(writer.session)] == [0, 0]

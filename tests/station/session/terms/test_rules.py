"""Rules: the pages that they are on, how corrections add up, and what no operator can have made."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from restore import BadInput, PageEdits
from station.session import add_rule, add_scan, open_session, undo
from station.session.terms.rules import MAX_RULES, RULES_TABLE, Rule, Scope, edits_of

MASK = {"what": "remove", "polygon": [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]}
OTHER = {"what": "keep", "polygon": [[5.0, 5.0], [20.0, 5.0], [20.0, 20.0]]}


def part(**fields):
    return {"parts": {"page": fields}}


@pytest.mark.parametrize(
    ("under", "over", "both"),
    [
        (part(turn=1), part(turn=0), part(turn=0)),
        (part(turn=1), {"layout": "whole"}, {"layout": "whole", **part(turn=1)}),
        (part(masks=[MASK]), part(masks=[OTHER]), part(masks=[MASK, OTHER])),
        (part(masks=[MASK]), part(masks=[]), part(masks=[])),
        (part(settings={"dpi": 300}), part(settings={"points": 500}), part(settings={"dpi": 300, "points": 500})),
    ],
)
def test_corrections_add_up_field_by_field(under, over, both):
    assert edits_of(under).merged(edits_of(over)).given() == both


def test_a_rule_is_frozen_and_follows_a_page_that_is_captured_again(volume, tiny_scan):
    with open_session(volume) as writer:
        first = add_scan(writer, tiny_scan, facts={})
        other = add_scan(writer, tiny_scan, facts={})
        event = add_rule(writer, Scope(captures=[first.number]), edits_of(part(turn=1)))
        again = add_scan(writer, tiny_scan, page=first.page, facts={})
        later = add_scan(writer, tiny_scan, facts={})
        history = writer.history
    (rule,) = RULES_TABLE.validate_python(event.facts["value"])
    assert rule.id == event.number
    assert [rule.is_on(history.shots(one)) for one in (first, other, again, later)] == [True, False, True, False]
    scopes = (Scope(), Scope(future=True), Scope(captures=[other.number], future=True))
    rules = [Rule(id=event.number, scope=scope, edits=PageEdits()) for scope in scopes]
    assert [[one.is_on(history.shots(shot)) for shot in (first, other, again, later)] for one in rules] == [
        [True, True, True, False],
        [True, True, True, True],
        [False, True, False, True],
    ]


def test_a_rule_is_one_event_and_one_undo(volume, tiny_scan):
    with open_session(volume) as writer:
        for _ in range(20):
            add_scan(writer, tiny_scan, facts={})
        before = len(writer.history.events)
        add_rule(writer, Scope(), edits_of(part(turn=1)))
        assert len(writer.history.events) == before + 1
        assert undo(writer).name == "rules"


@pytest.mark.parametrize("edits", [{"colour": "red"}, part(turn=9), {"version": 2}, part(rotate_deg=float("nan"))])
def test_rules_that_cannot_be_are_refused(volume, edits):
    with open_session(volume) as writer:
        with pytest.raises(BadInput):
            add_rule(writer, Scope(), edits_of(edits))
        assert len(writer.history.events) == 1


def test_nesting_has_an_end():
    table: dict = {}
    for _ in range(30_000):
        table = {"parts": table}
    with pytest.raises(BadInput, match="nested"):
        edits_of(table)


def test_there_are_no_more_rules_than_a_record_holds():
    rule = Rule(id=1, scope=Scope(), edits=PageEdits()).model_dump(mode="json")
    with pytest.raises(ValidationError):
        RULES_TABLE.validate_python([rule] * (MAX_RULES + 1))

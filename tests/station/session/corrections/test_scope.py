"""A rule before it is recorded."""

from __future__ import annotations

from station.session import add_scan, correct, open_session
from station.session.corrections.scope import parse_rule
from station.session.operations.corrections import plan_rule
from station.session.terms.rules import edits_of


def test_a_plan_freezes_the_pages_and_names_what_is_kept(volume, tiny_scan):
    with open_session(volume) as writer:
        shots = [add_scan(writer, tiny_scan, facts={}) for _ in range(3)]
        correct(writer, 2, edits_of({"layout": "whole", "parts": {"page": {"turn": 1, "masks": []}}}))
        scope, edits = parse_rule(writer.session, ["turn=2", "layout=split"], "2-3", future=False)
        planned = plan_rule(writer.session, scope, edits)
    assert planned.scope.captures == [shots[1].number, shots[2].number]
    assert list(planned.pages) == [2, 3]
    assert planned.own == {2: ("layout", "page.turn")}
    assert list(planned.lines()) == ["pages      2, 3", "own        page 2: its layout, page.turn is kept"]

"""The order of leaf sides: what is captured later keeps its place, what is split later moves with its page."""

from __future__ import annotations

import pytest

from station.errors import UsageError
from station.session import add_scan, open_session, undo
from station.session.leaves.leaf import LEFT_OUT, delivered_leaves, leaves_of
from station.session.log.steps import record_run
from station.session.operations.arrangement import change_leaf, keep_both, mark_missing, move_leaves
from station.session.terms.parts import RESTORE, VERDICT, parse_pages


def names(writer):
    return [leaf.name for leaf in leaves_of(writer.session)]


def test_a_decided_order_has_room_for_what_comes_later(volume, tiny_scan):
    with open_session(volume) as writer:
        shots = [add_scan(writer, tiny_scan, facts={}) for _ in range(3)]
        move_leaves(writer, ["3"], "1")
        assert names(writer) == ["3", "1", "2"]
        add_scan(writer, tiny_scan, facts={})
        assert names(writer) == ["3", "4", "1", "2"]  # after the page that it follows
        record_run(writer, RESTORE, shots[2], parameters={}, result={"parts": {"left": {}, "right": {}}})
        assert names(writer) == ["3/left", "3/right", "4", "1", "2"]
        move_leaves(writer, ["3/left"], "2")
        assert names(writer) == ["3/right", "4", "1", "3/left", "2"]
        assert change_leaf(writer, "3/right", left_out=True).slot == f"{LEFT_OUT}_right"
        assert [(leaf.name, leaf.position) for leaf in delivered_leaves(writer.session)] == [
            *(("4", 1), ("1", 2), ("3/left", 3), ("2", 4)),
        ]


def test_a_page_that_is_kept_is_not_found_the_same_until_it_is_captured_again(volume, tiny_scan):
    check = {"name": "similarity", "level": "red", "value": 0.9, "limits": [0.4, 0.6], "hint": "", "part": "left"}
    checks = [{**check, "text": f"same page as page {name} 0.9"} for name in ("1/left", "1/right")]
    with open_session(volume) as writer:
        add_scan(writer, tiny_scan, facts={})
        shot = add_scan(writer, tiny_scan, facts={})
        restored = record_run(writer, RESTORE, shot, parameters={}, result={})
        record_run(writer, VERDICT, restored, parameters={}, result={"level": "red", "checks": checks})
        assert keep_both(writer, 1) is None
        assert writer.history.page(2).level == "red"
        assert keep_both(writer, 2).facts["value"] == ["1/left", "1/right"]
        assert (writer.history.page(2).level, writer.history.page(2).quality.checks) == ("green", [])
        undo(writer)
        assert writer.history.page(2).level == "red"
        keep_both(writer, 2)
        add_scan(writer, tiny_scan, facts={}, page=2)
        assert writer.history.page(2).decided.keep_both == ()


def test_missing_leaves_keep_their_number(volume, tiny_scan):
    with open_session(volume) as writer:
        for _ in range(2):
            add_scan(writer, tiny_scan, facts={})
        mark_missing(writer, "2", ["2", "3"])
        assert [(leaf.label, leaf.missing) for leaf in leaves_of(writer.session)] == [("1", ()), ("4", ("2", "3"))]


def test_leaves_that_are_apart_are_moved_together(volume, tiny_scan):
    with open_session(volume) as writer:
        for _ in range(4):
            add_scan(writer, tiny_scan, facts={})
        move_leaves(writer, ["4", "2"], "1")
        assert names(writer) == ["4", "2", "1", "3"]
        move_leaves(writer, ["4"], None)
        assert names(writer) == ["2", "1", "3", "4"]
        with pytest.raises(UsageError, match="before itself"):
            move_leaves(writer, ["1", "2"], "2")
        assert names(writer) == ["2", "1", "3", "4"]


@pytest.mark.parametrize("text", ["", "a", "0", "3-", "1,,2", "10000"])
def test_pages_that_cannot_be(text):
    with pytest.raises(UsageError):
        parse_pages(text)

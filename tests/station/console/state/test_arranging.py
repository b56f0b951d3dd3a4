"""Leaf sides are moved together, in one step, in the order in which they are named."""

from __future__ import annotations

import pytest

from station.console.faults import ConsoleFault
from station.console.shown_pages.leaves import arrangement_tag
from station.console.state.arranging import change_leaf, leaf_named, move_leaves
from station.console.state.open_session import WritableSession
from station.errors import UsageError
from station.session import add_scan, open_session
from station.session.leaves.leaf import leaves_of
from tests.station.conftest import curl_scan
from tests.station.console.conftest import StandInRestorer
from tests.station.console.state.test_open_session import listener


@pytest.fixture
def opened(root):
    with open_session(root / "missale") as writer:
        for _ in range(4):
            add_scan(writer, curl_scan(), facts={})
    writable = WritableSession(root / "missale", None, listener(), restorations=StandInRestorer())
    writable.start()
    yield writable
    writable.close()


def names(opened):
    return [leaf.name for leaf in leaves_of(opened.session)]


def test_leaves_that_are_apart_are_moved_together(opened):
    move_leaves(opened, ["4", "2"], "1", 0)
    assert names(opened) == ["4", "2", "1", "3"]
    move_leaves(opened, ["4"], None, arrangement_tag(opened.session))
    assert names(opened) == ["2", "1", "3", "4"]
    with pytest.raises(ConsoleFault, match="before itself"):
        move_leaves(opened, ["1", "2"], "2", arrangement_tag(opened.session))
    assert names(opened) == ["2", "1", "3", "4"]


def test_a_label_that_cannot_be_ends_no_loop(opened):
    with pytest.raises(UsageError, match="control character"):
        change_leaf(opened, "1", 0, left_out=None, label="a\x00")
    with pytest.raises(ConsoleFault, match="no leaf 9"):
        change_leaf(opened, "9", 0, left_out=True, label=None)
    change_leaf(opened, "1", 0, left_out=True, label="iv")
    assert leaf_named(opened.session, "1").is_left_out

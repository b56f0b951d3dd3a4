"""A change that cannot be is the fault of its request, and ends no loop."""

from __future__ import annotations

from functools import partial

import pytest

from station.console.faults import ConsoleFault
from station.console.state.open_session import WritableSession
from station.errors import UsageError
from station.session import add_scan, correct, open_session
from station.session.leaves.leaf import leaves_of
from station.session.operations.arrangement import change_leaf
from station.session.terms.rules import edits_of
from tests.station.conftest import curl_scan
from tests.station.console.conftest import StandInRestorer
from tests.station.console.state.test_open_session import listener


@pytest.fixture
def opened(root):
    with open_session(root / "missale") as writer:
        add_scan(writer, curl_scan(), facts={})
    writable = WritableSession(root / "missale", None, listener(), restorations=StandInRestorer())
    writable.start()
    yield writable
    writable.close()


def test_a_change_that_cannot_be_ends_no_loop(opened):
    with pytest.raises(UsageError, match="control character"):
        opened.change(partial(change_leaf, name="1", label="a\x00"))
    with pytest.raises(ConsoleFault, match="no leaf 9") as missing:
        opened.change(partial(change_leaf, name="9", left_out=True))
    assert (missing.value.key, missing.value.hint) == ("no_page", "load the leaves again")
    with pytest.raises(ConsoleFault, match="frame") as space:
        opened.change(partial(correct, page=1, edits=edits_of({"frame": "space", "layout": "whole"})))
    assert space.value.key == "invalid"
    with pytest.raises(ConsoleFault, match="meanwhile") as stale:
        opened.change(partial(change_leaf, name="1", left_out=True, expected=9), lambda _session: {"tag": 0})
    assert (stale.value.key, stale.value.data) == ("changed", {"current": {"tag": 0}})
    opened.change(partial(change_leaf, name="1", left_out=True, label="iv"))
    assert [leaf.is_left_out for leaf in leaves_of(opened.session)] == [True]

"""Layouts that were found are kept, the latest ones."""

from __future__ import annotations

import pytest

from station.console.faults import ConsoleFault
from station.console.shown_pages import layouts
from station.console.shown_pages.layouts import Layouts
from station.session import add_scan, open_session
from station.session.log.steps import decide
from tests.station.conftest import curl_scan


def test_the_latest_layouts_are_kept_and_others_found_again(root, monkeypatch):
    found = []
    find = layouts.find_layout
    monkeypatch.setattr(layouts, "find_layout", lambda scan: found.append(scan.points.shape) or find(scan))
    kept = Layouts(limit=1)
    with open_session(root / "missale") as writer:
        one, two = (add_scan(writer, curl_scan(), facts={}) for _ in range(2))
        first = kept.of(writer.session, one)
        assert kept.of(writer.session, one) is first
        assert len(found) == 1
        kept.of(writer.session, two)
        assert kept.of(writer.session, one) == first
        assert len(found) == 3


def test_what_is_not_a_scan_has_no_layout(root):
    with open_session(root / "missale") as writer:
        label = decide(writer, "label", "1r", page=1)
        with pytest.raises(ConsoleFault, match="not a scan"):
            Layouts().of(writer.session, label)

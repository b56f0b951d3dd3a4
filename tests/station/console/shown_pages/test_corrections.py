"""The corrections of a page as JSON values: its own, and what holds."""

from __future__ import annotations

from restore import PageEdits
from station.console.shown_pages.corrections import corrections_of
from station.session import add_rule, add_scan, correct, open_session
from station.session.terms.rules import Scope, edits_of
from tests.station.conftest import curl_scan

TURNED = {"parts": {"page": {"turn": 1}}}


def test_own_corrections_are_null_until_the_page_has_some(root):
    with open_session(root / "missale") as writer:
        scan = add_scan(writer, curl_scan(), facts={})
        assert corrections_of(writer.session, 1)["edits"] is None
        add_rule(writer, Scope(captures=[scan.number]), edits_of(TURNED))
        shown = corrections_of(writer.session, 1)
        assert (shown["edits"], shown["effective"]["parts"]) == (None, TURNED["parts"])
        correct(writer, 1, PageEdits(layout="split"))
        assert corrections_of(writer.session, 1)["edits"]["layout"] == "split"

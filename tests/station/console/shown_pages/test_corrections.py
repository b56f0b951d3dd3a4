"""The corrections of a page as JSON values: its own, what holds, and the tag of what a draft was begun on."""

from __future__ import annotations

from station.console.shown_pages.corrections import corrections_of, tag_of
from station.session import add_rule, add_scan, correct, open_session
from station.session.terms.rules import Scope
from tests.station.conftest import curl_scan

TURNED = {"parts": {"page": {"turn": 1}}}


def test_the_tag_is_that_of_the_latest_correction_or_of_the_scan(root):
    with open_session(root / "missale") as writer:
        scan = add_scan(writer, curl_scan(), facts={})
        assert tag_of(writer.session, writer.history.page(1)) == scan.number
        corrected = correct(writer, 1, TURNED)
        assert tag_of(writer.session, writer.history.page(1)) == corrected.number
        rule = add_rule(writer, Scope(captures=[scan.number], over=[scan.number]), TURNED)
        assert tag_of(writer.session, writer.history.page(1)) == rule.number


def test_own_corrections_are_null_until_the_page_has_some(root):
    with open_session(root / "missale") as writer:
        scan = add_scan(writer, curl_scan(), facts={})
        assert corrections_of(writer.session, 1)["edits"] is None
        add_rule(writer, Scope(captures=[scan.number]), TURNED)
        shown = corrections_of(writer.session, 1)
        assert (shown["edits"], shown["effective"]["parts"]) == (None, TURNED["parts"])
        correct(writer, 1, {"layout": "split"})
        assert corrections_of(writer.session, 1)["edits"]["layout"] == "split"

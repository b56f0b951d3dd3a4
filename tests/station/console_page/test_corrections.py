"""The tool for one page or two: a draft, its source, and a version that another window saved first."""

from __future__ import annotations

import json

from tests.station.console_page.conftest import until

EDITS = "**/api/pages/7/edits"


def sent(canned):
    return [body for path, body in canned.pressed if path.endswith("/edits")]


def test_a_layout_is_a_draft_until_enter(show, canned):
    page = show(canned, "page/7")
    page.wait_for_selector(".light")
    page.keyboard.press("s")
    panel = page.get_by_role("region", name="Spine")
    panel.get_by_text("Now: As preset, from the preset.").wait_for()
    panel.get_by_text("118.4 mm from the left").wait_for()
    page.keyboard.press("2")
    panel.get_by_text("Split (2): not saved").wait_for()
    page.keyboard.press("Escape")
    panel.get_by_text("Dropped").wait_for()
    assert canned.pressed == []
    assert panel.evaluate("(one) => one.scrollWidth <= one.clientWidth")
    page.keyboard.press("3")
    page.keyboard.press("Enter")
    panel.get_by_text("Saved; the page").wait_for()
    assert sent(canned) == [{"edits": {"layout": "right", "by": {"tool": "console", "saw": 15}}}]
    with page.expect_response("**/api/press"):
        page.keyboard.press("Enter")  # without a draft it accepts the page, as ever
    assert canned.pressed[-1] == ("/api/press", {"action": "accept", "page": 7})


def test_a_second_enter_during_a_save_saves_nothing(show, canned):
    page = show(canned, "page/7")
    page.wait_for_selector(".light")
    held = []
    page.route(EDITS, lambda route: held.append(route) if route.request.method == "PUT" else route.fallback())
    page.keyboard.press("s")
    panel = page.get_by_role("region", name="Spine")
    panel.get_by_text("Now:").wait_for()
    page.keyboard.press("3")
    with page.expect_request(EDITS):
        page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    until(page, lambda: held)
    page.wait_for_timeout(100)  # a request that should not come has no event to wait for
    assert len(held) == 1
    held[0].fallback()
    panel.get_by_text("Saved; the page").wait_for()
    assert len(sent(canned)) == 1
    assert canned.pressed[-1][0].endswith("/edits")


def test_the_version_of_another_window_is_shown_next_to_this_one(show, canned):
    page = show(canned, "page/7")
    page.wait_for_selector(".light")
    tags: list[str] = []

    def refuse(route):
        if route.request.method != "PUT":
            return route.fallback()
        tags.append(route.request.headers["if-match"])
        if len(tags) > 1:
            return route.fallback()
        current = {**canned.answer("/api/pages/7/edits"), "tag": 41, "edits": {"layout": "left", "note": "torn"}}
        current["sources"] = [{"source": "page", "edits": current["edits"]}]
        fault = {"error": {"key": "changed", "text": "changed", "hint": "", "data": {"current": current}}}
        return route.fulfill(status=412, content_type="application/json", body=json.dumps(fault))

    page.route(EDITS, refuse)
    page.keyboard.press("s")
    panel = page.get_by_role("region", name="Spine")
    panel.get_by_text("Now:").wait_for()
    page.keyboard.press("2")
    page.keyboard.press("Enter")
    panel.get_by_text("saved “Left only (1)” meanwhile; yours is “Split (2)”").wait_for()
    assert sent(canned) == []
    panel.get_by_role("button", name="Keep mine").click()
    panel.get_by_text("Saved; the page").wait_for()
    assert tags == ['"14"', '"41"']
    assert sent(canned) == [{"edits": {"layout": "split", "note": "torn", "by": {"tool": "console", "saw": 15}}}]

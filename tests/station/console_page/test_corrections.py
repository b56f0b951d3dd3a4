"""The tools for corrections: a draft with its source, kept in its tab, and versions that another window saved first."""

from __future__ import annotations

import json

import pytest

from oracles.console.browser import READY_MS
from tests.station.console_page.conftest import until

EDITS = "**/api/pages/7/edits"


@pytest.fixture
def tool(show, canned):
    """Open page 7 with a tool, by its key, in a new window; gives the window and the tool's panel."""

    def opened(key, name, **look):
        page = show(canned, "page/7", **look)
        page.locator(".light").first.wait_for()
        page.keyboard.press(key)
        panel = page.get_by_role("region", name=name, exact=True)
        panel.get_by_role("listitem").first.wait_for()
        return page, panel

    return opened


def draft(page):
    return page.get_by_role("region", name="Not saved", exact=True)


def saved(page):
    draft(page).get_by_text("Saved; the page is restored again", exact=True).wait_for()


def sent(canned):
    return [body["edits"] for path, body in canned.pressed if path.endswith("/edits")]


def answer_with(page, canned, **changed):
    """Answer with other corrections of page 7 than the canned ones."""
    found = {**canned.answer("/api/pages/7/edits"), **changed}
    page.route(EDITS, lambda route: route.fulfill(json=found) if route.request.method == "GET" else route.fallback())


def test_a_layout_is_a_draft_until_enter(tool, canned):
    page, panel = tool("s", "Spine")
    panel.get_by_text("Layout: As preset, from the preset.", exact=True).wait_for()
    panel.get_by_text("118.4 mm from the left").wait_for()
    page.keyboard.press("2")
    draft(page).get_by_text("Split (2) instead of as preset").wait_for()
    page.keyboard.press("Escape")
    draft(page).get_by_text("Dropped", exact=True).wait_for()
    assert canned.pressed == []
    assert panel.evaluate("(one) => one.scrollWidth <= one.clientWidth")
    page.keyboard.press("3")
    page.keyboard.press("Enter")
    saved(page)
    assert sent(canned) == [{"layout": "right", "by": {"tool": "console", "saw": 15}}]
    with page.expect_response("**/api/press"):
        page.keyboard.press("Enter")  # without a draft it accepts the page, as ever
    assert canned.pressed[-1] == ("/api/press", {"action": "accept", "page": 7})


def test_a_second_enter_during_a_save_saves_nothing(tool, canned):
    page, _ = tool("s", "Spine")
    held = []
    page.route(EDITS, lambda route: held.append(route) if route.request.method == "PUT" else route.fallback())
    page.keyboard.press("3")
    with page.expect_request(EDITS):
        page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    until(page, lambda: held)
    page.wait_for_timeout(100)  # a request that should not come has no event to wait for
    assert len(held) == 1
    held[0].fallback()
    saved(page)
    assert len(sent(canned)) == 1
    assert canned.pressed[-1][0].endswith("/edits")


def refuse_first(page, canned, **changed):
    """Refuse the first save, as another window's was first. Returns the tags that saves came with."""
    tags: list[str] = []

    def answer(route):
        if route.request.method != "PUT":
            return route.fallback()
        tags.append(route.request.headers["if-match"])
        if len(tags) > 1:
            return route.fallback()
        current = {**canned.answer("/api/pages/7/edits"), "tag": 41, **changed}
        fault = {"error": {"key": "changed", "text": "changed", "hint": "", "data": {"current": current}}}
        return route.fulfill(status=412, content_type="application/json", body=json.dumps(fault))

    page.route(EDITS, answer)
    return tags


THEIRS = {"layout": "left", "note": "torn"}


def test_the_version_of_another_window_is_shown_next_to_this_one(tool, canned):
    page, _ = tool("s", "Spine")
    tags = refuse_first(page, canned, edits=THEIRS, sources=[{"source": "page", "edits": THEIRS}])
    page.keyboard.press("2")
    draft(page).get_by_text("Split (2) instead of").wait_for()
    page.keyboard.press("Enter")
    draft(page).get_by_text("yours Split (2), theirs Left only (1)").wait_for()
    page.keyboard.press("Enter")  # chooses neither
    assert (sent(canned), tags) == ([], ['"14"'])
    draft(page).get_by_role("button", name="Keep mine").click()
    saved(page)
    assert tags == ['"14"', '"41"']
    assert sent(canned) == [{"layout": "split", "note": "torn", "by": {"tool": "console", "saw": 15}}]


def test_the_version_of_another_window_can_be_taken(tool, canned):
    page, panel = tool("s", "Spine")
    tags = refuse_first(page, canned, edits=THEIRS, sources=[{"source": "page", "edits": THEIRS}])
    page.keyboard.press("2")
    draft(page).get_by_text("Split (2) instead of").wait_for()
    page.keyboard.press("Enter")
    draft(page).get_by_role("button", name="Take theirs").click()
    panel.get_by_text("Layout: Left only (1), from this page.", exact=True).wait_for()
    assert (sent(canned), tags) == ([], ['"14"'])


def test_a_draft_outlives_a_reload_of_its_tab_and_no_other_tab_has_it(tool, show, canned):
    page, _ = tool("t", "Rotation")
    page.keyboard.press(".")
    draft(page).get_by_text("90° instead of as found").wait_for()
    page.reload()
    draft(page).get_by_text("Not saved yet: kept in this window.", exact=True).wait_for(timeout=READY_MS)
    page.get_by_role("button", name="Save").click()
    saved(page)
    assert sent(canned) == [{"parts": {"page": {"turn": 1}}, "by": {"tool": "console", "saw": 15}}]
    other = show(canned, "page/7")
    other.locator(".light").first.wait_for()
    assert draft(other).is_hidden()


def test_a_draft_stays_with_its_page(tool, canned):
    page, _ = tool("t", "Rotation")
    page.keyboard.press(".")
    draft(page).get_by_text("90° instead of as found").wait_for()
    page.locator("#strip-8").click()
    page.get_by_role("heading", name="Page 8").wait_for()
    draft(page).wait_for(state="hidden")
    page.locator("#strip-7").click()
    draft(page).get_by_text("90° instead of as found").wait_for()
    assert canned.pressed == []


def test_a_page_that_another_window_corrected_before_a_reload_shows_both(tool, canned):
    page, _ = tool("s", "Spine")
    page.keyboard.press("2")
    draft(page).get_by_text("Split (2) instead of as preset").wait_for()
    answer_with(page, canned, tag=41, edits=THEIRS, sources=[{"source": "page", "edits": THEIRS}])
    page.reload()
    draft(page).get_by_text("yours Split (2), theirs Left only (1)").wait_for(timeout=READY_MS)


ANGLE = """(wanted) => { const { a, b } = document.querySelector(".over > g").transform.baseVal.consolidate().matrix;
                        return Math.abs((Math.atan2(b, a) * 180) / Math.PI - wanted) < 0.01 }"""


def drawn_at(page, angle):
    """Wait until the picture is drawn at an angle, by the overlay that follows it."""
    page.wait_for_function(ANGLE, arg=angle)


def test_a_page_is_turned_by_keys_and_the_picture_turns_at_once(tool, canned):
    page, panel = tool("t", "Rotation")
    for key in (".", ".", ",", "Shift+ArrowRight", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    draft(page).get_by_text("0.8° instead of as found").wait_for()
    assert panel.get_by_label("Degrees clockwise").input_value() == "0.8"
    drawn_at(page, 90.8)
    page.keyboard.press("v")  # as it was before
    drawn_at(page, 0)
    page.keyboard.press("v")
    drawn_at(page, 90.8)
    page.keyboard.press("Enter")
    saved(page)
    assert sent(canned)[0]["parts"] == {"page": {"turn": 1, "rotate_deg": 0.8}}


def test_the_earlier_restoration_is_shown_on_one_key(tool):
    page, _ = tool("l", "Light")
    with page.expect_request("**/api/pictures/14/page.dzi*"):  # the one before 15
        page.keyboard.press("v")
    page.get_by_role("button", name="Before", exact=True).and_(page.locator("[aria-pressed=true]")).wait_for()


def test_the_light_of_a_part_is_kept_or_removed_and_its_source_shown(show, canned):
    canned.rows[7] = {"parts": [{"part": "left", "name": "7/left"}, {"part": "right", "name": "7/right"}]}
    page = show(canned, "page/7")
    rule = {"source": "rule 9", "edits": {"parts": {"left": {"settings": {"shading": "remove"}}}}}
    own = {"source": "page", "edits": {"parts": {"left": {"settings": {"shading": "keep"}}}}}
    answer_with(page, canned, edits=own["edits"], sources=[rule, own])
    page.reload()
    page.locator(".light").first.wait_for(timeout=READY_MS)
    page.keyboard.press("l")
    panel = page.get_by_role("region", name="Light", exact=True)
    panel.get_by_text("Now: Keep, from this page.", exact=True).wait_for()
    page.keyboard.press("2")
    draft(page).get_by_text("Light (left) Remove instead of Keep", exact=True).wait_for()
    page.keyboard.press("1")  # as it is: there is nothing to save
    draft(page).wait_for(state="hidden")
    panel.get_by_role("button", name="Remove correction").click()  # the rule holds again
    draft(page).get_by_text("Light (left) as preset instead of Keep", exact=True).wait_for()
    panel.get_by_role("button", name="Remove (2)").and_(page.locator("[aria-pressed=true]")).wait_for()
    page.keyboard.press("Enter")
    saved(page)
    assert sent(canned) == [None]
    page.get_by_role("group", name="Leaf").get_by_role("button", name="right").click()
    panel.get_by_text("Now: Keep, from the preset.", exact=True).wait_for()


def plan_with(page, **plan):
    """Answer for rules: the same for one that is planned and for one that is made. Gives what was asked for."""
    asked = {"plan": [], "rules": []}

    def answer(route):
        asked[route.request.url.rpartition("/")[2]].append(route.request.post_data_json)
        route.fulfill(json={"pages": [], "own": {}, "rule": 60, **plan})

    page.route("**/api/rules**", answer)
    return asked


def test_a_correction_is_applied_to_the_following_pages_by_keys_alone(tool, canned):
    page, _ = tool("t", "Rotation")
    asked = plan_with(page, pages=[7, 8, 9, 10], own={"9": ["page.turn"]})
    page.keyboard.press(".")
    draft(page).get_by_text("90° instead of as found").wait_for()
    page.keyboard.press("a")
    dialog = page.get_by_role("dialog")
    dialog.get_by_text("Pages: 4: Page 7, Page 8, Page 9, Page 10", exact=True).wait_for()
    dialog.get_by_text("Page 9 keeps its own: Quarter turn", exact=True).wait_for()
    page.keyboard.press("Enter")
    draft(page).get_by_text("Applied to 4 pages; u undoes it", exact=True).wait_for()
    turned = {"turn": 1}
    rule = {
        "scope": {"captures": [14, 16, 18, 20], "future": False},
        "edits": {"parts": {"page": turned, "left": turned, "right": turned}},
    }
    assert asked["rules"] == [rule]
    assert asked["plan"][-1] == rule
    assert sent(canned) == []
    assert draft(page).get_by_role("button", name="Save").is_hidden()  # the rule gives it to this page, too


def test_a_page_that_is_ticked_does_not_keep_its_own(tool):
    page, _ = tool("t", "Rotation")
    asked = plan_with(page, pages=[7, 8, 9], own={"8": ["page.turn"], "9": ["page.turn"]})
    page.keyboard.press(".")
    draft(page).get_by_text("90° instead of as found").wait_for()
    page.keyboard.press("a")
    page.get_by_role("dialog").get_by_role("checkbox", name="replace it").nth(1).check()
    page.keyboard.press("Enter")
    draft(page).get_by_text("Applied to 3 pages; u undoes it", exact=True).wait_for()
    assert asked["rules"][0]["scope"] == {"captures": [14, 16, 18, 20], "future": False, "over": [18]}


def test_a_correction_is_applied_to_left_leaves_of_pages_by_number(tool):
    page, _ = tool("l", "Light")
    asked = plan_with(page, pages=[2, 4])
    page.keyboard.press("2")
    draft(page).get_by_role("listitem").first.wait_for()
    page.keyboard.press("a")
    dialog = page.get_by_role("dialog")
    dialog.get_by_role("radio", name="pages by number", exact=True).check()
    dialog.get_by_text("Choose corrections, and pages of this session.", exact=True).wait_for()
    dialog.get_by_role("textbox", name="Page numbers").fill("2, 4-99")
    dialog.get_by_role("radio", name="left leaves", exact=True).check()
    dialog.get_by_role("checkbox", name="Pages that are captured later").check()
    page.keyboard.press("Enter")  # there is no page 99
    assert asked["rules"] == []
    dialog.get_by_role("textbox", name="Page numbers").fill("2, 4-4")
    dialog.get_by_text("Pages: 2: Page 2, Page 4", exact=True).wait_for()
    page.keyboard.press("Enter")
    draft(page).get_by_text("Applied to 2 pages; u undoes it", exact=True).wait_for()
    edits = {"parts": {"left": {"settings": {"shading": "remove"}}}}
    assert asked["rules"] == [{"scope": {"captures": [4, 8], "future": True}, "edits": edits}]
    assert draft(page).get_by_role("button", name="Save").is_visible()  # it is not on this page


def test_the_next_and_the_previous_leaf_that_asks(show, canned):
    canned.rows[3] = {"asks": [{"name": "layout", "part": ""}]}
    halves = [{"part": "left", "name": "8/left"}, {"part": "right", "name": "8/right"}]
    canned.rows[8] = {"asks": [{"name": "corrections", "part": "right"}], "parts": halves}
    page = show(canned, "page/7")
    page.get_by_text("Questions: 2", exact=True).wait_for()
    page.keyboard.press("j")
    page.get_by_role("heading", name="Page 8").wait_for()
    right = page.get_by_role("group", name="Leaf").get_by_role("button", name="right")
    right.and_(page.locator("[aria-pressed=true]")).wait_for()
    page.keyboard.press("j")
    page.get_by_role("heading", name="Page 3").wait_for()
    page.keyboard.press("k")
    page.get_by_role("heading", name="Page 8").wait_for()


def test_without_a_question_the_keys_stay_on_the_page(tool):
    page, _ = tool("t", "Rotation")
    page.keyboard.press("j")
    page.keyboard.press("a")
    draft(page).get_by_text("This page has no correction that fits other scans", exact=True).wait_for()
    assert page.get_by_role("heading", name="Page 7").is_visible()

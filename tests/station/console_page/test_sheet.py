"""The contact sheet: thousands of leaves, moved by drag and by keys, left out, put back and labelled."""

from __future__ import annotations

import re
from contextlib import ExitStack

import pytest

from oracles.console import CannedStation
from oracles.console.browser import violations, window
from station.console.vendored import PAGE
from station.session.leaves.leaf import leaves_of
from tests.station.conftest import curl_scan
from tests.station.console.conftest import GatedScanner, StandInRestorer, root, serving
from tests.station.console.routes.test_pages import shoot

__all__ = ["root"]

MANY = 3000


@pytest.fixture
def sheet(show, canned):
    """Open the contact sheet by its key."""

    def opened(station=canned, **look):
        page = show(station, "page/1", **look)
        page.locator(".light").first.wait_for()
        page.keyboard.press("g")
        page.locator("#leaf-0").wait_for()
        page.locator(".sheet-sizer:focus").wait_for()
        return page

    return opened


@pytest.fixture
def station(root):
    """A served session of three pages, and a function that shows its contact sheet in a new window."""
    with ExitStack() as stack:
        served = stack.enter_context(serving(root, GatedScanner(curl_scan()), StandInRestorer(), page=PAGE))
        with served.client() as client:
            client.post("/api/sessions/missale/open")
            for _ in range(3):
                shoot(client)

        def shown(browser):
            page = stack.enter_context(window(browser, f"{served.origin}/enter?token={served.token}"))
            page.evaluate("location.hash = '#/sheet'")
            leaf(page, 3).wait_for()
            give_control(served, page)
            page.locator(".sheet-sizer").focus()
            return page

        yield served, shown


def give_control(served, page):
    """Let a window act; the other one only watches from now on."""
    with served.client(page.evaluate("sessionStorage['planish-tab']")) as client:
        client.post("/api/control", json={"tab": client.headers["X-Planish-Tab"]})


def leaf(page, name):
    return page.get_by_role("option", name=re.compile(rf"^Leaf {name}, "))


def changes(canned):
    return [(path, body) for path, body in canned.pressed if path in ("/api/order", "/api/leaves")]


def names(canned):
    return [one["name"] for one in canned.leaves]


def test_leaves_lie_as_openings_or_singles(sheet, canned):
    page = sheet()
    left = page.locator(".sheet-sizer").bounding_box()["x"]
    one, two, three = (leaf(page, name).bounding_box() for name in (1, 2, 3))
    assert left < one["x"] < two["x"] < three["x"]  # the first page lies right: nothing is to the left of it
    page.get_by_role("button", name="Singles").click()
    page.locator("#leaf-0[style*='translate(0px']").wait_for()
    assert changes(canned) == []


def test_a_place_that_is_empty_between_two_leaves_of_one_side_is_marked(sheet, canned):
    assert [canned.leaves[at]["side"] for at in (1, 2, 3)] == ["left", "right", "left"]
    canned.leaves[2]["side"] = "left"
    page = sheet()
    broken = page.get_by_role("option", name="order of sides broken")
    assert [one.get_attribute("data-at") for one in broken.all()] == ["2", "3"]
    assert page.locator(".leaf-missing[data-break]:visible").count() == 2
    page.get_by_role("button", name="Singles").click()
    broken.first.wait_for(state="detached")
    assert page.locator(".leaf-missing:visible").count() == 0


def test_leaves_are_shown_in_three_sizes(sheet):
    page = sheet()
    page.keyboard.press("End")
    for size, width in (("Large", 248), ("Small", 88), ("Medium", 140)):
        page.get_by_role("button", name=size).click()
        page.wait_for_function("(wide) => document.querySelector('.leaf[data-active]').offsetWidth === wide", arg=width)
        box, sheet_box = leaf(page, 10).bounding_box(), page.locator(".sheet-scroller").bounding_box()
        assert box["y"] + box["height"] <= sheet_box["y"] + sheet_box["height"]  # the active leaf stays in sight


def test_leaves_are_moved_by_keys_alone(sheet, canned):
    page = sheet()
    for key in ("ArrowRight", "Shift+ArrowRight", "Control+x", "End", "Control+v"):
        page.keyboard.press(key)
    page.get_by_text("Moved before 10: 2; u undoes it", exact=True).wait_for()
    assert changes(canned) == [("/api/order", {"leaves": ["2", "3"], "before": "10"})]
    assert names(canned)[-3:] == ["2", "3", "10"]
    with page.expect_response("**/api/press"):
        page.keyboard.press("u")
    assert canned.pressed[-1] == ("/api/press", {"action": "undo"})


def test_a_leaf_is_moved_by_drag(sheet, canned):
    page = sheet()
    page.get_by_role("button", name="Singles").click()
    page.locator(".leaf[aria-posinset='2']").wait_for()
    start, end = leaf(page, 5).bounding_box(), leaf(page, 2).bounding_box()
    page.mouse.move(start["x"] + 60, start["y"] + 60)
    page.mouse.down()
    page.mouse.move(end["x"] + 60, end["y"] + 60, steps=4)
    page.locator(".leaf[data-over]").wait_for()
    page.mouse.up()
    page.get_by_text("Moved before 2: 1; u undoes it", exact=True).wait_for()
    assert names(canned)[:4] == ["1", "5", "2", "3"]


def test_leaves_are_left_out_put_back_and_labelled(sheet, canned):
    page = sheet()
    page.keyboard.press("Delete")
    leaf(page, 1).and_(page.locator("[data-out]")).wait_for()
    page.get_by_text("Left out; they are kept", exact=True).wait_for()
    page.keyboard.press("Delete")
    page.get_by_text("Put back", exact=True).wait_for()
    page.keyboard.press("F2")
    page.get_by_role("textbox", name="Label").fill("ii")
    page.keyboard.press("Enter")
    page.get_by_role("option", name="Leaf 1, label ii").wait_for()
    page.keyboard.press("F2")
    page.get_by_role("textbox", name="Label").fill("wrong")
    page.keyboard.press("Escape")
    page.get_by_role("textbox", name="Label").wait_for(state="hidden")
    assert [body for _, body in changes(canned)] == [
        {"leaf": "1", "left_out": True},
        {"leaf": "1", "left_out": False},
        {"leaf": "1", "label": "ii"},
    ]


def test_leaves_are_numbered_from_one_on_and_missing_ones_get_a_place(browser, station):
    _, shown = station
    page = shown(browser)
    page.keyboard.press("ArrowRight")
    page.keyboard.press("#")
    dialog = page.get_by_role("dialog", name="Number from leaf 2 on")
    dialog.get_by_label("Numbering").select_option("folio")
    dialog.get_by_label("First number").fill("4")
    page.keyboard.press("Enter")
    page.get_by_role("option", name="Leaf 3, label 4v").wait_for()
    page.keyboard.press("+")
    page.get_by_role("dialog", name="Missing before leaf 2").get_by_label("Labels of the missing leaves").fill("i, ii")
    page.keyboard.press("Enter")
    page.get_by_role("option", name="Missing before it: i, ii").wait_for()
    assert page.locator(".leaf-missing:visible").all_inner_texts() == ["i", "ii"]
    page.get_by_role("button", name="Singles").click()
    page.locator(".leaf[aria-posinset='2'][style*='translate(444px']").wait_for()  # behind the leaf and two gaps
    page.locator(".sheet-sizer").focus()
    page.keyboard.press("#")
    page.get_by_role("dialog").get_by_label("Numbering").select_option("")
    page.keyboard.press("Enter")
    page.get_by_role("option", name="Leaf 3, label 5").wait_for()


def test_a_page_is_captured_to_lie_before_a_leaf(sheet, canned):
    page = sheet()
    page.keyboard.press("ArrowRight")
    with page.expect_response("**/api/press"):
        page.keyboard.press("i")
    assert canned.pressed[-1] == ("/api/press", {"action": "insert", "page": 2})


def test_a_leaf_is_dragged_by_a_finger_that_rested_on_it(sheet, canned):
    page = sheet()
    page.get_by_role("button", name="Singles").click()
    page.locator(".leaf[aria-posinset='2']").wait_for()
    start, end = leaf(page, 5).bounding_box(), leaf(page, 2).bounding_box()
    session = page.context.new_cdp_session(page)

    def touch(kind, box=None):
        at = [] if box is None else [{"x": box["x"] + 60, "y": box["y"] + 60}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})

    touch("touchStart", start)
    touch("touchMove", end)  # at once: it scrolls
    touch("touchEnd")
    touch("touchStart", start)
    page.locator(".leaf[data-over]").wait_for()
    touch("touchMove", end)
    page.locator("#leaf-1[data-over]").wait_for()
    touch("touchEnd")
    page.get_by_text("Moved before 2: 1; u undoes it", exact=True).wait_for()
    assert [body for _, body in changes(canned)] == [{"leaves": ["5"], "before": "2"}]


def test_leaves_that_are_chosen_here_are_those_that_corrections_are_applied_to(sheet):
    page = sheet()
    for key in ("Shift+ArrowRight", "Shift+ArrowRight", "ArrowRight", "ArrowRight", "Space"):
        page.keyboard.press(key)
    leaf(page, 5).and_(page.locator("[aria-selected=true]")).wait_for()
    page.evaluate("location.hash = '#/page/7'")
    page.locator(".light").first.wait_for()
    page.keyboard.press("l")
    page.get_by_role("region", name="Light", exact=True).get_by_role("listitem").first.wait_for()
    page.keyboard.press("2")
    page.get_by_role("region", name="Not saved", exact=True).get_by_role("listitem").first.wait_for()
    page.keyboard.press("a")
    page.get_by_role("dialog").get_by_role("radio", name="pages by number").check()
    assert page.get_by_role("textbox", name="Page numbers").input_value() == "1-3, 5"


def test_of_thousands_of_leaves_only_those_in_sight_are_elements(sheet):
    page = sheet(CannedStation(PAGE, pages=MANY))
    assert page.locator(".leaf").count() < 100
    page.keyboard.press("End")
    leaf(page, MANY).wait_for()
    assert page.locator(".leaf").count() < 100
    assert leaf(page, MANY).get_attribute("aria-setsize") == str(MANY)


def set_label(page, text):
    page.get_by_role("textbox", name="Label").fill(text)
    page.keyboard.press("Enter")


def test_the_label_that_another_window_set_meanwhile_is_shown_next_to_this_one(browser, station):
    served, shown = station
    first = shown(browser)
    first.keyboard.press("F2")
    second = shown(browser)
    second.keyboard.press("F2")
    set_label(second, "v")
    for page in (first, second):
        page.get_by_role("option", name="Leaf 1, label v").wait_for()
    give_control(served, first)
    set_label(first, "iv")
    dialog = first.get_by_role("dialog", name="Changed in another window")
    dialog.wait_for()
    assert dialog.get_by_role("listitem").all_inner_texts() == ["Yours: iv", "Theirs: v"]
    dialog.get_by_role("button", name="Keep mine").click()
    first.get_by_role("option", name="Leaf 1, label iv").wait_for()


def test_the_order_that_another_window_made_meanwhile_is_shown_next_to_this_one(browser, station):
    served, shown = station
    first = shown(browser)
    first.keyboard.press("ArrowRight")
    first.keyboard.press("Control+x")  # leaf 2
    second = shown(browser)
    for key in ("End", "Control+x", "Home", "Control+v"):
        second.keyboard.press(key)
    first.locator("#leaf-0[aria-label^='Leaf 3,']").wait_for()
    give_control(served, first)
    first.keyboard.press("Home")
    first.keyboard.press("Control+v")
    dialog = first.get_by_role("dialog", name="Changed in another window")
    dialog.wait_for()
    assert dialog.get_by_role("listitem").all_inner_texts() == ["Yours: 2, 3, 1", "Theirs: 3, 1, 2"]
    dialog.get_by_role("button", name="Take theirs").click()
    dialog.wait_for(state="detached")
    assert [one.name for one in leaves_of(served.app_state.opened().session)] == ["3", "1", "2"]


@pytest.mark.parametrize("look", [("dark", "en"), pytest.param(("light", "de"), marks=pytest.mark.slow)], ids="-".join)
def test_axe_finds_nothing(sheet, canned, axe, look):
    canned.leaves[4]["side"] = "left"
    canned.leaves[2] |= {"left_out": True, "missing": ["[3]"], "same": ["2"]}
    page = sheet(theme=look[0], language=look[1])
    page.keyboard.press("Space")
    page.locator(".leaf[aria-selected=true]").wait_for()
    assert violations(page, axe) == []
    page.keyboard.press("F2")
    page.locator(".leaf-label:focus").wait_for()
    assert violations(page, axe) == []
    page.keyboard.press("Escape")
    for key in ("#", "+"):
        page.locator(".sheet-sizer:focus").wait_for()
        page.keyboard.press(key)
        page.get_by_role("dialog").wait_for()
        assert violations(page, axe) == []
        page.keyboard.press("Escape")

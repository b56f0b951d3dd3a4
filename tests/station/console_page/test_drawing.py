"""Points drawn on the scanner's picture: by mouse, by keys and by touch they come to the same bytes."""

from __future__ import annotations

import json
import re

import pytest

from oracles.console.browser import READY_MS

MOVED_PX = (40, 25)  # of the screen


@pytest.fixture
def drawn(show, canned):
    """Open page 7 with a tool, by its key, and begin to draw; gives the window when its points are there."""

    def opened(*keys, points):
        page = show(canned, "page/7")
        page.locator(".light").first.wait_for()
        page.keyboard.press(keys[0])
        for key in keys[1:]:
            press_until(page, key, f".handle:nth-child({points})")
        return page

    return opened


def press_until(page, key, sign):
    """Press a key as soon as the scanner's picture is there, and wait for what it does."""
    page.locator(".page-viewer[data-scan]").wait_for(timeout=READY_MS)
    page.keyboard.press(key)
    page.locator(sign).wait_for()


def handle(page, number=1):
    return page.locator(f".handle:nth-child({number})")


def place(page, number=1):
    """Where a point is, in px of the picture."""
    _, _, x, y = map(int, re.findall(r"\d+", handle(page, number).get_attribute("aria-label")))
    return x, y


def middle(page, number=1):
    box = handle(page, number).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def by_mouse(page):
    x, y = middle(page)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + MOVED_PX[0], y + MOVED_PX[1], steps=3)
    page.mouse.up()


def by_touch(page):
    x, y = middle(page)
    session = page.context.new_cdp_session(page)
    for kind, part in (("touchStart", 0.0), ("touchMove", 0.5), ("touchMove", 1.0), ("touchEnd", None)):
        at = [] if part is None else [{"x": x + part * MOVED_PX[0], "y": y + part * MOVED_PX[1]}]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})


def by_keys(page, to):
    handle(page).focus()
    for axis, key in enumerate(("ArrowRight", "ArrowDown")):
        tens, ones = divmod(to[axis] - place(page)[axis], 10)
        for _ in range(tens):
            page.keyboard.press(f"Shift+{key}")
        for _ in range(ones):
            page.keyboard.press(key)


def save(page, canned):
    """Save the draft, and give the corrections that were sent, as bytes."""
    page.keyboard.press("Enter")
    page.get_by_text("Saved; the page is restored again", exact=True).wait_for()
    path, body = canned.pressed[-1]
    assert path.endswith("/edits")
    return json.dumps(body["edits"]).encode()


def test_an_outline_by_mouse_by_keys_and_by_touch_is_the_same_bytes(drawn, canned):
    page = drawn("o", "d", points=4)
    first = place(page)
    by_mouse(page)
    moved = place(page)
    assert all(new > old for new, old in zip(moved, first, strict=True))
    mouse = save(page, canned)
    page = drawn("o", "d", points=4)
    by_touch(page)
    page.wait_for_function(
        "(label) => document.querySelector('.handle').ariaLabel !== label", arg=f"Point 1 of 4: {first[0]}, {first[1]}"
    )
    touch = save(page, canned)
    page = drawn("o", "d", points=4)
    by_keys(page, moved)
    assert save(page, canned) == mouse == touch
    outline = json.loads(mouse)["parts"]["page"]["outline"]
    assert outline[0] == list(moved)
    assert len(outline) == 4


def test_points_are_added_and_taken_away_by_keys_and_by_a_click(drawn, canned):
    page = drawn("o", "d", points=4)
    (x0, y0), (x1, _) = place(page, 1), place(page, 2)
    handle(page).focus()
    page.keyboard.press("+")
    handle(page, 5).wait_for()
    assert place(page, 2) == (pytest.approx((x0 + x1) / 2, abs=1), y0)
    page.keyboard.press("Delete")
    handle(page, 5).wait_for(state="detached")
    (left, top), (right, _) = middle(page, 1), middle(page, 2)
    page.mouse.click((left + right) / 2, top + 30)  # within the picture, nearest to the first side
    handle(page, 5).wait_for()
    assert place(page, 2)[1] > y0
    for count in (4, 3, 3):  # fewer than three have no area
        page.keyboard.press("-")
        handle(page, count + 1).wait_for(state="detached")
    page.get_by_text("At least 3 points are needed", exact=True).wait_for()
    assert len(json.loads(save(page, canned))["parts"]["page"]["outline"]) == 3


def test_areas_are_removed_and_kept(drawn, canned):
    page = drawn("x", "1", points=4)
    page.keyboard.press("2")
    page.get_by_role("combobox", name="Area").and_(page.locator("[data-names*='2 · ']")).wait_for()
    x, y = place(page)
    handle(page).focus()
    page.keyboard.press("Shift+ArrowLeft")
    assert place(page) == (x - 10, y)
    page.get_by_role("combobox", name="Area").select_option("0")
    page.get_by_role("button", name="Delete area").click()
    masks = json.loads(save(page, canned))["parts"]["page"]["masks"]
    assert [one["what"] for one in masks] == ["keep"]
    assert masks[0]["polygon"][0] == [x - 10, y]


def test_a_spine_is_drawn_from_the_one_that_was_found(show, canned):
    page = show(canned, "page/7")
    page.locator(".light").first.wait_for()
    page.keyboard.press("s")
    page.get_by_text("118.4 mm from the left").wait_for()
    page.keyboard.press("d")
    handle(page, 2).wait_for()
    (x, y), tail = place(page, 1), place(page, 2)
    assert (x, y) == (322, 18)
    handle(page, 1).focus()
    page.keyboard.press("ArrowLeft")
    edits = json.loads(save(page, canned))
    assert edits["spine"] == [[321, 18], list(tail)]
    assert "layout" not in edits


def test_a_spine_is_moved_as_a_whole_by_keys_of_its_tool(show, canned):
    page = show(canned, "page/7")
    page.locator(".light").first.wait_for()
    page.keyboard.press("s")
    page.get_by_text("118.4 mm from the left").wait_for()
    for key in ("Shift+ArrowRight", "ArrowRight", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
    handle(page, 2).wait_for()
    found = canned.answer("/api/pages/7/layout")["spine"]
    assert json.loads(save(page, canned))["spine"] == [[round(x) + 9, round(y)] for x, y in found]


def test_a_page_is_cropped_to_a_margin_and_to_a_box(show, canned):
    page = show(canned, "page/7")
    page.locator(".light").first.wait_for()
    page.keyboard.press("c")
    page.get_by_text("Crop: as found.", exact=True).wait_for()
    page.keyboard.press("2")
    page.get_by_text("Margin 3 mm instead of as found").wait_for()
    page.keyboard.press("3")
    handle(page, 2).wait_for()
    handle(page, 1).focus()
    page.keyboard.press("Shift+ArrowRight")
    crop = json.loads(save(page, canned))["parts"]["page"]["crop"]
    width, height = canned.sheet.size
    mm = 25.4 / canned.answer("/api/pages/7")["dpi"]
    assert crop["mode"] == "box"
    assert crop["box"] == pytest.approx([10 * mm, 0, width * mm, height * mm], abs=0.005)


def test_an_outline_is_drawn_where_no_page_was_found(show, canned):
    canned.rows[7] = {"failed": {"text": "no page is in sight", "hint": "capture it again"}, "restore": None}
    page = show(canned, "page/7")
    page.get_by_role("heading", name="This page could not be restored").wait_for()
    page.keyboard.press("o")
    press_until(page, "d", ".handle:nth-child(4)")

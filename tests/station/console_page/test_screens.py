"""What the screens do: with a canned station, whose state is whatever a test needs."""

from __future__ import annotations

import json
import re
from functools import partial

import pytest

from oracles.console import CannedStation, preview
from oracles.console.answers import words
from oracles.console.browser import violations
from station.console.vendored import PAGE
from tests.station.console_page.conftest import until

DENSE = 307_200  # samples of a FINE shot
LOOSE_FPS = 5.0  # frames in a second on a machine with many at work; bench/console_page.py measures them alone
TURNING_MS = 1500
SIZES = ((1280, 800), (1024, 768), (768, 1024))  # a desk, a 10-inch tablet lying and standing
TOUCH_PX = 40  # a finger; the parts of a group of 44 px have its border around them
COUNT_FRAMES = """async (ms) => {
  const canvas = [...document.querySelectorAll(".model-canvas")].find((one) => !one.hidden);
  const [before, start] = [Number(canvas.dataset.frames), performance.now()];
  await new Promise((done) => setTimeout(done, ms));
  return ((Number(canvas.dataset.frames) - before) / (performance.now() - start)) * 1000;
}"""


def tool(page, name):
    page.get_by_role("group", name="Tools").get_by_role("button", name=name).click()


def presses(canned):
    return [body for path, body in canned.pressed if path == "/api/press"]


def pressed(page, canned, act, count=1):
    """The actions that the server was asked for, when as many have come as were expected."""
    act()
    until(page, lambda: len(presses(canned)) >= count)
    return presses(canned)


KEYS = {
    " ": {"action": "capture"},
    "Enter": {"action": "accept", "page": 10},
    "r": {"action": "again", "page": 10},
    "u": {"action": "undo"},
    "m": {"action": "mark", "page": 10},
    "i": {"action": "insert", "page": 10},
}


def test_a_key_does_what_its_button_does(show, canned):
    page = show(canned)
    for count, (key, body) in enumerate(KEYS.items()):
        asked = pressed(page, canned, partial(page.keyboard.press, key), count=2 * count + 1)
        assert asked[2 * count :] == [body]
        button = page.locator(f"[data-action={body['action']}]")
        assert pressed(page, canned, button.click, count=2 * count + 2)[2 * count :] == [body, body]


def test_the_foot_switch_shoots_after_a_button_was_clicked(show, canned):
    """A blank would press the button once more if that kept the focus."""
    page = show(canned)
    pressed(page, canned, page.locator("[data-action=mark]").click)
    assert pressed(page, canned, lambda: page.keyboard.press(" "), count=2)[1] == {"action": "capture"}


def test_a_note_is_written_in_a_dialog_where_keys_are_letters(show, canned):
    page = show(canned)
    page.keyboard.press("n")
    page.get_by_label("Note to this page").fill("umr")
    page.keyboard.press("Tab")
    assert pressed(page, canned, lambda: page.get_by_role("button", name="Save").click()) == [
        {"action": "note", "page": 10, "text": "umr"}
    ]


def test_single_letters_can_be_switched_off(show, canned):
    page = show(canned)
    page.keyboard.press("?")
    page.get_by_label(re.compile("Single letters")).check()
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog", state="detached")  # it closes after the key: a blank before would go to its field
    page.keyboard.press("u")
    assert pressed(page, canned, lambda: page.keyboard.press(" ")) == [{"action": "capture"}]


def test_nothing_is_asked_for_while_the_scanner_works(show, canned):
    page = show(canned)
    canned.change(scanner={"busy": "capture", "laser": "on", "step": "scan", "done": 0.4})
    page.wait_for_selector("[data-laser=on]")
    assert page.locator(".laser").inner_text() == "LASER ON"
    assert "scanning · 40 %" in page.locator(".shot-progress").inner_text()
    page.keyboard.press(" ")
    page.locator("[data-action=capture]").click(force=True)
    canned.change(scanner={"busy": None, "laser": "off"})
    page.wait_for_selector("[data-laser=off]")
    assert pressed(page, canned, lambda: page.keyboard.press("m")) == [{"action": "mark", "page": 10}]


def test_a_page_of_the_strip_is_the_one_that_keys_act_on(show, canned):
    page = show(canned)
    page.locator("#strip-7").click()
    assert page.get_by_role("heading", level=1).inner_text() == "Page 7"
    assert page.locator(".sign").inner_text() == "Amber"
    focus = page.locator(".light:first-child", has_text="Amber above 1.2 px, red above 2 px.")
    focus.get_by_text("Focus again").wait_for()
    assert pressed(page, canned, lambda: page.keyboard.press("r")) == [{"action": "again", "page": 7}]


@pytest.mark.slow
@pytest.mark.parametrize("screen", ["capture", "page/10"])
def test_no_lights_are_shown_until_those_of_the_page_are_known(show, canned, screen):
    page, held = show(canned, screen), []
    page.wait_for_selector(".light")
    page.route("**/api/pages/7", lambda route: held.append(route))
    page.locator("#strip-7").click()
    page.get_by_role("heading", level=1, name="Page 7").wait_for()
    until(page, lambda: held)
    assert page.locator(".light").count() == 0
    held[0].continue_()
    page.wait_for_selector(".light")


def test_the_worst_pages_come_first(show, canned):
    canned.pages = 25
    page = show(canned)
    page.get_by_role("button", name="Worst first").click()
    page.locator(".strip-scroller").evaluate("one => { one.scrollLeft = 0; }")
    page.wait_for_function("() => document.querySelector('[aria-posinset=\"1\"]')?.dataset.page === '11'")
    first = [page.locator(f"[aria-posinset='{at}']").get_attribute("data-page") for at in range(1, 6)]
    assert first == ["11", "22", "7", "14", "21"]


def test_a_thousand_pages_are_few_elements(show):
    page = show(CannedStation(PAGE, pages=1000))
    page.wait_for_selector("#strip-1000")
    scroller = page.locator(".strip-scroller")
    assert scroller.evaluate("one => one.scrollWidth") == 1000 * 116
    for at in (0, 50_000, 99_000):
        scroller.evaluate(f"one => {{ one.scrollLeft = {at}; }}")
        page.wait_for_selector(f"#strip-{at // 116 + 2}:visible")
        assert page.locator(".card").count() < 25


def test_the_arrow_keys_go_along_the_strip(show):
    page = show(CannedStation(PAGE, pages=300))
    page.get_by_role("listbox", name="Pages").focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert page.get_by_role("heading", level=1).inner_text() == "Page 2"
    page.keyboard.press("End")
    page.wait_for_selector("[aria-selected=true][data-page='300']")


def test_the_preview_shows_what_it_is_for(show, canned):
    canned.preview = preview()
    page = show(canned)
    page.get_by_role("button", name="Preview").first.click()
    reported = page.locator(".aids").inner_text()
    for text in ("White 0.21 %", "842 mm", "962 mm", "Measured from 861 to 931 mm", "Focus 0.82 px", "clipped 0.25 %"):
        assert text in reported
    overlay = page.locator(".overlay")
    assert overlay.is_visible()
    page.get_by_role("button", name="Aids").click()
    assert not overlay.is_visible()


def test_the_ruler_measures_on_the_page_and_in_space(show, canned):
    page = show(canned, "page/3")
    tool(page, "Ruler")
    viewer = page.locator(".page-viewer")
    page.wait_for_selector(".crosshair", state="attached")
    viewer.click(position={"x": 300, "y": 200})
    page.get_by_text("Now the second point.").wait_for()
    page.get_by_role("button", name="Point at the cross").click()
    page.get_by_text("120.44 mm").wait_for()
    assert page.locator(".ruler circle").count() == 2


def test_words_lie_over_the_page_and_are_found(show, canned):
    page = show(canned, "page/3")
    tool(page, "Words")
    page.get_by_text("words were read").wait_for()
    assert "".join(page.locator(".words text").all_text_contents()).split() == [word["text"] for word in words()]
    page.get_by_label("Search the volume").fill("CREASE")
    page.wait_for_selector(".words .hit")
    assert page.locator(".words .hit").count() == sum("crease" in word["text"].lower() for word in words()) > 0
    page.get_by_role("button", name="Page 2").click()
    page.wait_for_selector(".words .chosen")
    assert page.get_by_role("heading", level=1).inner_text() == "Page 2"
    tool(page, "Look")
    tool(page, "Words")  # drawn once more: what was chosen stays so
    page.wait_for_selector(".words .chosen")
    page.get_by_label("Search the volume").fill("another")
    page.wait_for_selector(".words .chosen", state="detached")  # of the search before


def test_ruler_words_and_model_are_those_of_the_leaf_that_is_shown(show, canned):
    halves = [{"part": part, "name": f"2/{part}"} for part in ("left", "right")]
    canned.rows |= {2: {"parts": halves}, 3: {"parts": halves}}
    found = canned.answer("/api/search")
    page = show(canned, "page/3")
    page.locator(".light").first.wait_for()
    leaf = page.get_by_role("group", name="Leaf")
    with page.expect_request("**/api/pages/3/words?leaf=left."):
        tool(page, "Words")
    with page.expect_request("**/api/pages/3/words?leaf=right."):
        leaf.get_by_role("button", name="right").click()
    page.wait_for_selector(".words text", state="attached")
    hit = {**found["hits"][0], "part": "left"}
    page.route("**/api/search?*", lambda route: route.fulfill(json={**found, "hits": [hit]}))
    page.get_by_label("Search the volume").fill("CREASE")
    with page.expect_request("**/api/pages/2/words?leaf=left."):
        page.get_by_role("button", name="Page 2").click()
    page.wait_for_selector(".words .chosen")
    leaf.get_by_role("button", name="left").and_(page.locator("[aria-pressed=true]")).wait_for()
    tool(page, "Ruler")
    page.wait_for_selector(".crosshair", state="attached")
    here = page.get_by_role("button", name="Point at the cross")
    here.click()
    page.get_by_text("Now the second point.").wait_for()
    with page.expect_request(lambda one: "/measure?" in one.url and one.url.endswith("&leaf=left.")):
        here.click()
    page.get_by_text("120.44 mm").wait_for()
    with page.expect_request("**/api/models/*/mesh?leaf=left.*"):
        tool(page, "3D")
    page.locator(".model-status", has_text="triangles").wait_for()
    with page.expect_request("**/api/models/*/mesh?leaf=right.*"):
        leaf.get_by_role("button", name="right").click()


def test_before_and_after_lie_over_each_other(show, canned):
    page = show(canned, "page/3")
    tool(page, "Compare")
    handle = page.get_by_role("slider", name="Boundary")
    page.wait_for_selector(".tiles.before canvas", state="attached")
    handle.focus()
    page.keyboard.press("ArrowLeft")
    assert handle.get_attribute("aria-valuenow") == "48"
    page.keyboard.press("Home")
    assert handle.get_attribute("aria-valuenow") == "0"
    box = page.locator(".page-viewer").bounding_box()
    handle.hover()
    page.mouse.down()
    page.mouse.move(box["x"] + 0.75 * box["width"], box["y"] + 100)
    page.mouse.up()
    assert handle.get_attribute("aria-valuenow") == "75"


def test_both_leaves_of_an_opened_book_are_shown(show, canned):
    canned.rows[7] = {"parts": [{"part": part, "name": f"7/{part}"} for part in ("left", "right")]}
    page = show(canned, "page/7")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    thumbnails = page.locator("#strip-7 img")
    assert [re.search(r"/15/(.*)/thumb", one.get_attribute("src"))[1] for one in thumbnails.all()] == [
        "left.page",
        "right.page",
    ]
    leaves = page.get_by_role("group", name="Leaf")
    assert leaves.get_by_role("button", name="left").get_attribute("aria-pressed") == "true"
    leaves.get_by_role("button", name="right").click()
    until(page, lambda: any("/15/right.page.dzi" in url for url in asked))
    page.locator("#strip-8").click()
    leaves.wait_for(state="hidden")


def test_a_verdict_says_that_the_calibration_is_nominal(show, canned):
    page = show(canned, "page/3")
    page.get_by_role("group", name="Verdict").get_by_text("The scanner is not calibrated").wait_for()


def test_layers_and_their_colours(show, canned):
    page = show(canned, "page/3")
    page.get_by_label("Strain").check()
    page.get_by_text("+1 %").wait_for()
    page.get_by_label("Coverage").check()
    page.get_by_text("shape interpolated 0.15 %").wait_for()
    page.get_by_label("Uncertainty").check()
    page.get_by_text("13 µm rms over the page, 4.6 µm of it noise; 95 % of the places are within 31 µm").wait_for()
    page.get_by_text("50 µm", exact=True).wait_for()
    page.locator(".legends .ramp").nth(1).wait_for()
    page.get_by_label("Uncertainty").uncheck()
    page.get_by_text("50 µm", exact=True).wait_for(state="detached")
    page.get_by_role("button", name="Light master").click()
    page.wait_for_load_state("networkidle")
    assert page.get_by_role("button", name="Light master").get_attribute("aria-pressed") == "true"


def test_a_dense_scan_turns_and_a_page_falls_flat(show, canned):
    canned.points = DENSE
    page = show(canned, "page/3")
    tool(page, "3D")
    kinds = page.get_by_role("group", name="What is shown")
    kinds.get_by_role("button", name="Points").click()
    page.get_by_text("307,200 measured points").wait_for()
    page.get_by_role("button", name="Turn the model").click()
    assert page.evaluate(COUNT_FRAMES, TURNING_MS) > LOOSE_FPS
    for kind, reported in {"Mesh": "15,", "Strain": "15,", "Falling flat": "8 recorded steps"}.items():
        kinds.get_by_role("button", name=kind).click()
        page.locator(".model-status", has_text=reported).wait_for()
    page.get_by_role("slider", name="How far").fill("1")
    assert page.get_by_role("slider", name="How far").input_value() == "1"


def test_a_second_window_watches_and_is_shown_why(show, canned):
    page = show(canned)
    canned.change(control={"tab": "x" * 32, "since": "2026-03-02T09:00:00Z", "agent": "Firefox on Linux"})
    page.get_by_text("This window only watches.").wait_for()
    assert "Firefox on Linux has had control since" in page.locator(".notice").inner_text()
    button = page.locator("[data-action=capture]")
    assert button.get_attribute("aria-disabled") == "true"
    assert button.get_attribute("title") == "Another window has control; this one is read-only"
    page.keyboard.press(" ")
    with page.expect_response("**/api/control"):
        page.get_by_role("button", name="Take control").click()
    assert [path for path, _ in canned.pressed] == ["/api/control"]


def test_a_lost_connection_is_reported_and_found_again(show, canned):
    page = show(canned)
    page.context.set_offline(True)
    page.get_by_text("No connection to Planish.").first.wait_for()
    assert page.locator(".laser").inner_text() == "Laser unknown"
    page.context.set_offline(False)
    page.get_by_text("No connection to Planish.").first.wait_for(state="detached")
    assert page.locator(".laser").inner_text() == "Laser off"


def test_the_language_and_the_theme_are_chosen(show, canned):
    page = show(canned)
    page.get_by_role("button", name="Deutsch").click()
    page.get_by_role("button", name="Neu aufnehmen").wait_for()
    assert page.evaluate("document.documentElement.lang") == "de"
    page.get_by_role("button", name="Dunkelkammer").click()
    assert page.evaluate("document.documentElement.dataset.theme") == "light"


@pytest.mark.parametrize("language", ["en", "de"])
def test_every_control_of_the_shoot_screen_is_in_sight_and_large_enough(show, canned, language):
    page = show(canned, language=language)
    page.wait_for_selector(".light")
    for width, height in SIZES:
        page.set_viewport_size({"width": width, "height": height})
        for button in page.locator(".capture-screen button:visible, .top button:visible, .rail a").all():
            box, name = button.bounding_box(), (width, button.inner_text())
            assert box["x"] >= 0 and box["x"] + box["width"] <= width, name
            assert box["y"] >= 0 and box["y"] + box["height"] <= height, name
            assert min(box["width"], box["height"]) >= TOUCH_PX, name
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_a_page_that_looks_like_an_earlier_one_is_seen_next_to_it_and_kept(show, canned, axe):
    def same(route):
        found = canned.answer("/api/pages/10")
        one = next(check for check in found["checks"] if check["name"] == "similarity")
        twice = [{**one, "level": "red", "value": value, "part": "left", "same_as": "4/right"} for value in (0.9, 0.95)]
        route.fulfill(json={**found, "checks": [*twice, *(check for check in found["checks"] if check is not one)]})

    canned.rows[4] = {"parts": [{**canned.row(4)["parts"][0], "part": part} for part in ("left", "right")]}
    page = show(canned)
    page.route("**/api/pages/10", same)
    canned.send("page", {"page": {**canned.row(10), "level": "red"}})
    page.get_by_text("Looks like Page 4, right.").wait_for()
    assert page.locator(".light", has_text="Same page").inner_text().splitlines()[1:3] == ["Same page · left", "0.95"]
    page.keyboard.press("b")
    figures = page.locator(".both figure")
    assert figures.all_inner_texts() == ["Page 4, right", "Page 10, left"]
    assert [one.get_attribute("src").split("?")[0] for one in figures.locator("img").all()] == [
        "/api/pictures/9/right.page/full",
        "/api/pictures/21/page/full",
    ]
    assert violations(page, axe) == []
    keep = page.get_by_role("button", name="Keep both: they differ")
    assert pressed(page, canned, keep.click) == [{"action": "keep_both", "page": 10}]
    canned.send("page", {"page": {**canned.row(10), "kept": ["4/right"]}})
    page.get_by_text("Kept; it looks like Page 4, right.").wait_for()
    assert page.locator(".light", has_text="Same page").get_attribute("data-level") == "green"


@pytest.mark.parametrize("size", [(1440, 900), (1280, 720), (1024, 768), (390, 844)])
def test_the_page_screen_has_one_line_of_tools_and_whole_labels(show, canned, size):
    page = show(canned, "page/8", language="de", size=size)
    page.wait_for_selector(".light")
    head, tools = page.locator(".page-screen .viewer-head"), page.get_by_role("group", name="Werkzeuge")
    assert head.bounding_box()["height"] < 1.5 * tools.bounding_box()["height"] < 75
    assert len(tools.get_by_role("button").all()) == 11  # each with a name, whether it is shown or not
    last, box = tools.get_by_role("button", name="Licht").bounding_box(), tools.bounding_box()
    assert last["x"] + last["width"] <= box["x"] + box["width"]
    assert page.evaluate("document.documentElement.scrollHeight") <= size[1]
    label = page.locator("#strip-8 .card-label")
    label.evaluate("(one) => { one.textContent = '24–25'; }")
    assert label.evaluate("(one) => one.scrollWidth <= one.clientWidth")


def test_settings_that_differ_are_shown_and_sent(show, canned):
    page = show(canned, "settings")
    mode = page.locator("[data-key='capture.mode']")
    assert "preset: fine" in mode.inner_text()
    page.get_by_role("spinbutton", name="Distance").fill("850")
    page.get_by_text("Not in use yet: 1").wait_for()
    mode.get_by_role("button", name="Back to the preset").click()
    page.get_by_text("Not in use yet: 2").wait_for()
    page.get_by_role("button", name="Use from the next page").click()
    page.get_by_text("Recorded; they hold").wait_for()
    values = next(body["values"] for path, body in canned.pressed if path == "/api/settings")
    assert values == {"capture.mode": None, "capture.distance_mm": 850}


def test_a_row_that_comes_while_all_are_loaded_is_not_undone_by_them(show, canned):
    """The answer was made before page 4 was judged, and comes after that was told."""
    page, held = show(canned), []
    old = {4: {"level": "", "busy": True}, 5: {"level": "red"}}  # page 5 shows when the answer has come
    pages = [{**row, **old.get(row["page"], {})} for row in canned.answer("/api/pages")["pages"]]
    page.route("**/api/pages", lambda route: held.append(route))
    canned.send("pages", {})
    until(page, lambda: held)
    canned.send("page", {"page": {**canned.row(4), "level": "amber", "note": "told"}})
    page.wait_for_selector("#strip-4[data-level=amber]")
    held[0].fulfill(json={"pages": pages})
    page.wait_for_selector("#strip-5[data-level=red]")
    assert page.locator("#strip-4").get_attribute("data-level") == "amber"


@pytest.mark.slow
def test_a_state_that_comes_while_it_is_asked_for_is_not_undone_by_the_answer(show, canned):
    """The answer was made before the laser went on, and comes after that was told: a lit laser never shows as off."""
    page, held = show(canned), []
    page.wait_for_selector("[data-laser=off]")
    old = json.loads(json.dumps(canned.state))
    page.route("**/api/state", lambda route: held.append(route))
    canned.send("reset", {})
    until(page, lambda: held)
    canned.change(scanner={"busy": "capture", "laser": "on", "step": "scan", "done": 0.4})
    page.wait_for_selector("[data-laser=on]")
    with page.expect_request("**/api/pages"):  # asked for when the answer has been read
        held[0].fulfill(json=old)
    assert page.locator(".laser").inner_text() == "LASER ON"

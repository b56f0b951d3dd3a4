"""Reviewing a volume with one hand: outliers come first, one key a leaf, the zoom stays."""

from __future__ import annotations

import re

import pytest

from oracles.console import CannedStation
from oracles.console.answers import reviewed
from oracles.console.browser import violations
from station.console.vendored import PAGE
from tests.station.console_page.conftest import until

FAULTS = {41: 1.91, 97: 2.9, 133: 2.4, 180: 2.5, 222: 2.6, 263: 1.33}  # leaf → rank
COUNT_KEYS = "() => { globalThis.pressed = 0; addEventListener('keydown', () => { globalThis.pressed += 1; }, true); }"


def shown(page, name):
    page.wait_for_selector(f".review-screen[data-leaf='{name}']")


@pytest.fixture
def volume(monkeypatch):
    """A station with 300 leaves, six of which have a fault."""
    station = CannedStation(PAGE, pages=300)
    leaves = [
        {**reviewed(n), "rank": FAULTS.get(n, 0.2), "level": "red" if n in FAULTS else "green"} for n in range(1, 301)
    ]
    checks = [check for check in leaves[0]["checks"] if check["level"] == "green"]
    for one in leaves:
        one["checks"] = [{**check, "level": one["level"]} if check["name"] == "blur_px" else check for check in checks]
    answer = station.answer
    monkeypatch.setattr(station, "answer", lambda path: {"leaves": leaves} if path == "/api/review" else answer(path))
    return station


def test_six_faults_of_three_hundred_leaves_are_marked_with_twelve_keys(show, volume):
    page = show(volume, "review")
    page.evaluate(COUNT_KEYS)
    worst = sorted(FAULTS, key=lambda leaf: -FAULTS[leaf])
    for leaf in worst:
        shown(page, leaf)
        page.keyboard.press("m")
        page.keyboard.press("d")
    until(page, lambda: len(volume.pressed) == len(worst))
    assert [body for _, body in volume.pressed] == [{"action": "mark", "page": leaf} for leaf in worst]
    assert page.evaluate("globalThis.pressed") == 2 * len(worst)
    assert page.get_by_text("7 of 300, 6 questionable").is_visible()


def test_a_key_goes_on_accepts_or_rejects_and_keeps_the_zoom(show, volume):
    page = show(volume, "review")
    shown(page, 97)
    page.get_by_role("button", name="In order").click()
    shown(page, 97)  # the leaf that is looked at stays
    page.locator(".zoomed", has_text=re.compile("[1-9]")).wait_for()
    whole = page.locator(".zoomed").inner_text()
    page.locator(".review-screen .openseadragon-canvas").click()  # which takes no keys of its own here
    page.keyboard.press("+")
    page.wait_for_function("(whole) => document.querySelector('.zoomed').textContent !== whole", arg=whole)
    zoomed = page.locator(".zoomed").inner_text()
    for key, leaf in ((" ", 98), ("ArrowRight", 99), ("a", 98), ("s", 133), ("w", 97), ("e", 98), ("x", 99)):
        page.keyboard.press(key)
        shown(page, leaf)
    page.keyboard.press("r")  # here no key starts the scanner
    until(page, lambda: len(volume.pressed) == 2)
    assert [body for _, body in volume.pressed] == [{"action": "accept", "page": 97}, {"action": "reject", "page": 98}]
    page.wait_for_load_state("networkidle")
    assert page.locator(".zoomed").inner_text() == zoomed


@pytest.mark.parametrize(("theme", "language"), [("dark", "en"), ("light", "de")])
def test_a_bar_shows_its_leaves_alone_and_axe_finds_nothing(show, canned, axe, theme, language):
    page = show(canned, "review", theme=theme, language=language)
    shown(page, 7)
    page.wait_for_load_state("networkidle")
    assert violations(page, axe) == []
    bars = page.locator(".chart").nth(1).get_by_role("button")
    widest = bars.last
    widest.click()
    assert widest.get_attribute("aria-pressed") == "true"
    count = page.get_by_role("status").filter(has_text=re.compile("of 2|von 2"))
    count.wait_for()  # two of ten leaves are 0.4 mm wider
    bars.last.click()
    page.get_by_text(re.compile("of 10|von 10")).wait_for()

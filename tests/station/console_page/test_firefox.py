"""The smoke path in Firefox, at a console that is served: the link, the first screen, a shot, its verdict, its page."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from oracles.console import CannedStation, serving
from oracles.console.firefox import Deadline, Firefox, find_firefox, firefox
from oracles.console.process import Console
from station.console.vendored import PAGE, missing_files
from station.session import read_session
from station.session.fixity.verify import verify
from tests.station.console_page.test_served import LONG_SHOT_S, console

__all__ = ["console"]

NEW_SESSION = """(async () => {
  const { post } = await import("/page/js/api.js");
  await post("/api/sessions", { name: "missale", title: "Missale Romanum" });
  await post("/api/sessions/missale/open");
  return "open";
})()"""
SCREENS = {"sessions": ".session", "settings": ".setting", "batch": ".screen-head", "export": ".format"}


@pytest.fixture
def browser() -> Iterator[Firefox]:
    if (program := find_firefox()) is None:
        pytest.skip("needs the system package firefox-esr")
    if missing := missing_files():
        pytest.skip(f"needs {', '.join(missing)}: run python -m station.console.vendored")
    with firefox(program) as started:
        yield started


def there(selector: str) -> str:
    """An expression that is true when an element is on the page."""
    return f"Boolean(document.querySelector({json.dumps(selector)}))"


def show(browser: Firefox, screen: str, sign: str) -> None:
    browser.evaluate(f"location.hash = '#/{screen}'; null")
    browser.wait_for(there(sign))


@contextmanager
def page_seven(browser: Firefox) -> Iterator[CannedStation]:
    """A station whose page 7 the browser shows."""
    station = CannedStation(PAGE)
    with serving(station) as address:
        browser.go(f"{address}/#/page/7")
        browser.wait_for("document.documentElement.dataset.ready")
        browser.wait_for(there(".light"))
        yield station
        browser.go("about:blank")


@pytest.mark.slow
def test_the_smoke_path(browser: Firefox, console: Console) -> None:
    browser.go(console.start(LONG_SHOT_S))
    browser.wait_for("document.documentElement.dataset.ready")
    browser.evaluate("window.faults = []; addEventListener('error', (event) => faults.push(event.message)); null")
    assert browser.evaluate(NEW_SESSION) == "open"
    show(browser, "capture", "[data-action=capture]:not([aria-disabled])")
    browser.press(" ")
    browser.wait_for(there("[data-laser=on]"))
    browser.wait_for(there("[data-laser=off]"))
    browser.wait_for(there("#strip-1[data-level=green]"))
    browser.wait_for(there(".light"))
    show(browser, "page/1", ".tiles canvas")
    browser.evaluate("document.querySelectorAll('.page-screen .viewer-head .segment')[4].click(); null")
    browser.wait_for("/triangles|points|No 3D view/.test(document.querySelector('.model-view').textContent)")
    browser.press("m")
    browser.wait_for(there("#strip-1[aria-label*=marked]"))
    for screen, sign in SCREENS.items():
        show(browser, screen, sign)
    assert browser.evaluate("faults.length") == 0
    browser.go("about:blank")
    console.close()
    session = read_session(console.folder / "missale")
    assert [page.decided.mark for page in session.history.pages()] == [True]
    assert verify(session.folder).problems == ()


DRAWN = "document.querySelectorAll('.handle').length"
FIRST = "document.querySelector('.handle')"
LEFT, ENTER = "\ue012", "\ue007"  # WebDriver (W3C), table of the keys


@pytest.mark.slow
def test_a_spine_and_an_outline_are_drawn(browser: Firefox) -> None:
    with page_seven(browser) as station:
        for tool, sign, points in (("s", ".spine-tool:not([hidden]) li", 2), ("o", "[data-scan]", 4)):
            browser.press(tool)
            browser.wait_for(there(sign))
            browser.wait_for("document.querySelector('.spine-tool').textContent.includes('118.4')")
            browser.press("d")
            browser.wait_for(f"{DRAWN} === {points}")
            before = browser.evaluate(f"{FIRST}.ariaLabel")
            browser.evaluate(f"{FIRST}.focus(); null")
            browser.press(LEFT)
            browser.wait_for(f"{FIRST}.ariaLabel !== {json.dumps(before)}")
            browser.press(ENTER)
            browser.wait_for("/Saved/.test(document.querySelector('.draft-panel').textContent)")
            browser.press(tool)  # ends the tool
    spine, outline = (body["edits"] for path, body in station.pressed if path.endswith("/edits"))
    assert spine["spine"] == [[321, 18], [321, 462]]
    corners = outline["parts"]["page"]["outline"]
    assert len(corners) == 4
    assert corners[0][0] == corners[3][0] - 1  # the left side was straight


PLACES = """JSON.stringify([...document.querySelectorAll(".handle")].map(
  (one) => one.ariaLabel.match(/\\d+/g).slice(2).map(Number)))"""
MIDDLE = (
    f"(({{ x, y, width, height }}) => JSON.stringify([x + width / 2, y + height / 2]))({FIRST}.getBoundingClientRect())"
)


@pytest.mark.slow
def test_an_outline_is_drawn_by_mouse(browser: Firefox) -> None:
    with page_seven(browser) as station:
        browser.press("o")
        browser.wait_for(there("[data-scan]"))
        browser.wait_for(there(".outline-tool:not([hidden]) li"))
        browser.press("d")
        browser.wait_for(f"{DRAWN} === 4")
        before = json.loads(browser.evaluate(PLACES))
        x, y = map(round, json.loads(browser.evaluate(MIDDLE)))
        browser.drag((x, y), (x + 40, y + 25))
        browser.wait_for(f"{PLACES} !== {json.dumps(json.dumps(before, separators=(',', ':')))}")
        after = json.loads(browser.evaluate(PLACES))
        browser.press(ENTER)
        browser.wait_for("/Saved/.test(document.querySelector('.draft-panel').textContent)")
    assert after[1:] == before[1:]
    assert all(new > old for new, old in zip(after[0], before[0], strict=True))
    ((_, body),) = (one for one in station.pressed if one[0].endswith("/edits"))
    assert body["edits"]["parts"]["page"]["outline"] == after


def test_a_deadline_that_has_passed_ends_every_wait() -> None:
    assert Deadline(60.0).left("nothing") > 0
    with pytest.raises(TimeoutError, match="not within 0 s: the verdict"):
        Deadline(0.0).left("the verdict")

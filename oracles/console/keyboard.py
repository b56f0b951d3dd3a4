"""An operator who works a volume through in the browser by the keyboard alone, and the keys that each opening takes."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from oracles.console.browser import server_answer

if TYPE_CHECKING:
    from playwright.sync_api import Page

WAIT_MS = 300_000  # for a shot, a restoration or an export on a machine with many at work
POLL_MS = 200  # between two questions to the server, which has work to do
MAX_TABS = 60  # from one end of a screen to the other
SPINE_KEYS = ("s", "Shift+ArrowRight")  # the spine found, moved by ten pixels
FOCUSED = """() => {
  const one = document.activeElement;
  if (!one.matches("a, button, input")) return "";
  const label = one.labels?.[0]?.querySelector("strong") ?? one.querySelector(".button-text, span");
  return (label?.textContent || one.ariaLabel || one.textContent || "").trim();
}"""
HINDRANCE = "async (action) => (await import('/page/js/actions.js')).reason(action)"
CURRENT = "async () => (await import('/page/js/store.js')).current()?.page"
DELIVERED = ("BagIt", "METS", "IIIF", "PDF/A")  # in the order of the screen


class Worked(NamedTuple):
    """An opening as it was worked.

    what  was done: plain, again, layout or spine. keys: that were pressed for it. leaves: that it gave.
    """

    page: int
    what: str
    keys: int
    leaves: int
    seconds: float


class Keyboard:
    """The keys of a window, counted."""

    def __init__(self, page: Page) -> None:
        self.page, self.count = page, 0

    def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        for key in keys:
            self.page.keyboard.press(key)
        self.count += len(keys)

    def type(self, text: str) -> None:
        """Type a text."""
        self.page.keyboard.type(text)
        self.count += len(text)

    def tab_to(self, name: str, key: str = "Tab") -> None:
        """Press Tab until the focus is on what has a name. Raises AssertionError."""
        for _ in range(MAX_TABS):
            if self.page.evaluate(FOCUSED) == name:
                return
            self.press(key)
        raise AssertionError(f"the Tab key does not come to {name}")


def work(page: Page, title: str, openings: int, moved: Collection[int]) -> list[Worked]:
    """Make a session in an empty folder, and capture, correct and accept its openings.

    moved: numbers of the pages whose spine is moved.
    """
    keyboard = Keyboard(page)
    keyboard.tab_to("New session")
    keyboard.press("Enter")
    page.get_by_role("dialog").wait_for()
    keyboard.type(title)
    keyboard.press("Enter")
    page.get_by_text("Ready for the first page").wait_for()
    keyboard.tab_to("Page", "Shift+Tab")
    keyboard.press("Enter")
    page.locator("#main[data-screen=page]").wait_for()
    return [_worked(Keyboard(page), number, number in moved) for number in range(1, openings + 1)]


def deliver(page: Page) -> int:
    """Export the open session in each format, and return the keys. Raises AssertionError for one that is not valid."""
    keyboard = Keyboard(page)
    keyboard.tab_to("Export", "Shift+Tab")
    keyboard.press("Enter")
    page.locator("#main[data-screen=export]").wait_for()
    page.locator(".plain-screen option").first.wait_for(state="attached")
    keyboard.tab_to(DELIVERED[0])
    for number, name in enumerate(DELIVERED, 1):
        assert page.evaluate(FOCUSED) == name
        keyboard.tab_to("Deliver and check")
        keyboard.press("Enter")
        page.locator(f".job:nth-last-child({number}):not([data-state=waiting]):not([data-state=running])").wait_for(
            timeout=WAIT_MS
        )
        if number < len(DELIVERED):
            keyboard.tab_to(name, "Shift+Tab")
            keyboard.press("ArrowDown")
    assert page.locator(".validated[data-level=green]").count() == len(DELIVERED), page.locator(".jobs").inner_text()
    return keyboard.count


def wait_until_current(page: Page, number: int) -> None:
    """Wait until the window's keys act on a page. Raises TimeoutError."""
    _wait_until(page, lambda: page.evaluate(CURRENT) == number)


def _worked(keyboard: Keyboard, number: int, is_moved: bool) -> Worked:
    """Capture an opening, and do what the station asks for, until it is accepted."""
    start, what = time.monotonic(), "plain"
    row = _captured(keyboard, number, " ")
    if row["level"] == "red":
        what, row = "again", _captured(keyboard, number, "r", "again")
    if is_moved or row["asks"]:
        what = "spine" if is_moved else "layout"
        keyboard.press("s")
        keyboard.page.locator(".spine-tool:not([hidden])", has_text="mm from the left").wait_for(timeout=WAIT_MS)
        keyboard.press(*(SPINE_KEYS[1:] if is_moved else ("2",)))
        keyboard.page.locator(".draft-panel li").first.wait_for()
        keyboard.press("Enter")
        row = _checked(keyboard.page, number, row["restore"])
        keyboard.press("s")
    _wait_until_able(keyboard.page, "accept")
    keyboard.press("Enter")
    keyboard.page.locator(f"#strip-{number}[aria-label*=accepted]").wait_for(timeout=WAIT_MS)
    return Worked(number, what, keyboard.count, len(row["parts"]), time.monotonic() - start)


def _captured(keyboard: Keyboard, number: int, key: str, action: str = "capture") -> Mapping[str, Any]:
    """Press a key that captures, and return the row of the page when it is checked."""
    page = keyboard.page
    _wait_until(page, lambda: server_answer(page, "/api/state")["scanner"]["connected"])
    _wait_until_able(page, action)
    before = next((row["restore"] for row in server_answer(page, "/api/pages")["pages"] if row["page"] == number), None)
    keyboard.press(key)
    return _checked(page, number, before)


def _checked(page: Page, number: int, before: int | None) -> Mapping[str, Any]:
    """Return the row of a page when it is restored again and checked."""

    def checked() -> Mapping[str, Any] | None:
        rows = [row for row in server_answer(page, "/api/pages")["pages"] if row["page"] == number]
        is_done = rows and not rows[0]["busy"] and rows[0]["level"] and rows[0]["restore"] != before
        return rows[0] if is_done else None

    row: Mapping[str, Any] = _wait_until(page, checked)
    page.locator(f"#strip-{number}[data-level={row['level']}]:not([data-busy])").wait_for(timeout=WAIT_MS)
    wait_until_current(page, number)
    page.locator(".page-screen .light").first.wait_for(timeout=WAIT_MS)
    return row


def _wait_until_able(page: Page, action: str) -> None:
    """Wait until the window takes an action: it hears of the server's state later than a question to the server."""
    _wait_until(page, lambda: page.evaluate(HINDRANCE, action) == "")


def _wait_until(page: Page, come: Callable[[], Any]) -> Any:
    """Return the first true value. Raises TimeoutError."""
    deadline = time.monotonic() + WAIT_MS / 1000
    while not (found := come()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"nothing came within {WAIT_MS / 1000:g} s: {server_answer(page, '/api/state')}")
        page.wait_for_timeout(POLL_MS)
    return found

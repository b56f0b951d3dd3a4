"""A whole shift at a console that is served: ten pages, two shot again, an undo, a crash, its recovery, an export."""

from __future__ import annotations

import os
import signal
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import psutil
import pytest

from oracles.console.browser import window
from oracles.console.keyboard import wait_until_current
from oracles.console.process import Console
from station.session import read_session
from station.session.fixity.verify import verify
from station.session.leaves.overview import overview
from tests.station.console_page.test_served import WAIT_MS, begin, console, shoot

if TYPE_CHECKING:
    from playwright.sync_api import Page

__all__ = ["console"]

PAGES = 10


def checked(page: Page, number: int) -> str:
    """The level of a page, when its verdict is on the screen."""
    from playwright.sync_api import TimeoutError as TookTooLong

    checked_card = f"#strip-{number}[data-level]:not([data-level='']):not([data-busy])"
    try:
        page.wait_for_selector(checked_card, timeout=WAIT_MS)
    except TookTooLong as error:
        reported = page.evaluate("fetch('/api/pages').then((answer) => answer.json())")["pages"]
        card = page.locator(f"#strip-{number}").evaluate("(card) => card.outerHTML")
        raise AssertionError(f"the server says {reported[number - 1]}, the screen {card}") from error
    page.wait_for_selector(".light", timeout=WAIT_MS)
    return str(page.locator(f"#strip-{number}").get_attribute("data-level"))


def accept(page: Page, number: int) -> None:
    wait_until_current(page, number)
    page.keyboard.press("Enter")
    page.wait_for_selector(f"#strip-{number}[aria-label*=accepted]")


@pytest.mark.slow
def test_a_shift_with_a_crash_in_the_middle(browser: Any, console: Console) -> None:
    with ExitStack() as stack:
        page = stack.enter_context(window(browser, console.start()))
        begin(page)
        for number in (1, 2):
            shoot(page, number)
            assert checked(page, number) == "green"
            accept(page, number)
        shoot(page, 3)
        assert checked(page, 3) == "red"
        page.locator(".light:first-child", has_text="Focus again").wait_for()
        shoot(page, 3, "r")
        page.wait_for_selector("#strip-3[data-level=green]", timeout=WAIT_MS)
        accept(page, 3)
        page.keyboard.press("u")
        page.wait_for_selector("#strip-3:not([aria-label*=accepted])")
        accept(page, 3)
        stop_restoring(console)  # so that neither page is restored when the console is killed, on any machine
        for number in (4, 5):
            shoot(page, number)
        console.kill()
        page.get_by_text("No connection to Planish.").first.wait_for()
        link = console.start()
        page = stack.enter_context(window(browser, link))
        page.get_by_role("button", name="Open", exact=True).click()
        page.get_by_role("heading", name="Nothing is lost").wait_for()
        recovered = page.locator(".recovery").inner_text()
        assert "5 pages" in recovered
        assert "4, 5" in recovered
        page.get_by_role("button", name="Continue capturing").click()
        for number in (4, 5):
            assert checked(page, number) == "green"
        for number in range(6, PAGES + 1):
            shoot(page, number)
        for number in range(4, PAGES + 1):
            checked(page, number)
            page.locator(f"#strip-{number}").click()
            accept(page, number)
        export(page)
    console.kill(signal.SIGTERM)
    session = read_session(console.folder / "missale-romanum")
    reported = overview(session)["pages"]
    assert [one["state"] for one in reported] == ["accepted"] * PAGES
    assert verify(session.folder).problems == ()


def stop_restoring(console: Console) -> None:
    """Let the process that restores do nothing any more; it ends with the console."""
    children = psutil.Process(console.processes[-1].pid).children()
    restoring = [one.pid for one in children if any("spawn_main" in word for word in one.cmdline())]
    assert restoring
    for number in restoring:
        os.kill(number, signal.SIGSTOP)


def export(page: Page) -> None:
    """Deliver the session, and see what the validator says."""
    page.evaluate("location.hash = '#/export'")
    page.locator("option", has_text="Missale Romanum").wait_for(state="attached")  # the sessions are there
    page.get_by_role("button", name="Deliver and check").click()
    page.get_by_text("The validator found it correct").wait_for(timeout=WAIT_MS)

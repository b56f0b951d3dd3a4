"""A console that is served, in a browser: a second window, a shot whose window goes, the link of an earlier start."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import psutil
import pytest

from oracles.console.browser import READY_MS, window
from oracles.console.process import Console, console_of
from station.session import read_session
from station.session.fixity.verify import verify
from tests.station.console.conftest import wait_for

if TYPE_CHECKING:
    from playwright.sync_api import Page

WAIT_MS = 120_000  # for a restoration, on a machine with many at work: the first compiles or loads the kernels
LONG_SHOT_S = "3"  # that the laser is on: time to pull a cable, on a machine with many at work
ASLEEP = ("server asleep", "browser asleep")
ASLEEP_S = 6.0  # longer than the page takes as a hitch
# A busy browser may draw nothing while the laser is on: its changes are listed all the same.
WATCH_LASER = """() => {
  const laser = document.querySelector(".laser");
  window.lit = false;
  new MutationObserver((changes) => {
    window.lit ||= laser.dataset.laser === "on" || changes.some((one) => one.oldValue === "on");
  }).observe(laser, { attributeFilter: ["data-laser"], attributeOldValue: true });
}"""
# The picture of the first shot is drawn, and the page says what becomes of it.
WAITING = """() => {
  const [picture, note] = [".shot-link img", ".shot-waiting"].map((one) => document.querySelector(one));
  return picture?.src.includes("/original/full?") && picture.naturalWidth > 0 && note && !note.hidden
    && note.textContent === "Page 1 is being restored …" && document.querySelector("h1").textContent === "Page 1";
}"""


@pytest.fixture
def console(tmp_path: Path) -> Iterator[Console]:
    with console_of(tmp_path) as started:
        yield started


def begin(page: Page, title: str = "Missale Romanum") -> None:
    """Make a session and go to the shoot screen; the scanner is ready."""
    page.get_by_role("button", name="New session").first.click()
    page.get_by_label("Title of the volume").fill(title)
    page.get_by_role("button", name="Begin").click()
    page.get_by_text("Ready for the first page").wait_for()
    page.locator("[data-action=capture]:not([aria-disabled])").wait_for()


def shoot(page: Page, number: int, key: str = " ") -> None:
    """Shoot, and wait until the page is stored."""
    before = page.locator(f"#strip-{number}").count()
    page.locator("[data-action=capture]:not([aria-disabled])").wait_for()
    page.evaluate(WATCH_LASER)
    page.keyboard.press(key)
    page.wait_for_function("() => window.lit")
    page.wait_for_selector("[data-laser=off]", timeout=WAIT_MS)
    if not before:
        page.wait_for_selector(f"#strip-{number}", timeout=WAIT_MS)


def test_a_second_window_watches_until_it_takes_over(browser: Any, console: Console) -> None:
    with window(browser, console.start()) as first:
        begin(first)
        second = first.context.new_page()
        second.goto(first.url)
        second.get_by_text("This window only watches.").wait_for()
        assert second.locator("[data-action=capture]").get_attribute("aria-disabled") == "true"
        shoot(first, 1)
        second.wait_for_selector("#strip-1", timeout=WAIT_MS)
        second.get_by_role("button", name="Take control").click()
        first.get_by_text("This window only watches.").wait_for()
        assert first.locator("[data-action=capture]").get_attribute("aria-disabled") == "true"


@pytest.mark.slow
def test_the_first_shot_is_on_the_screen_at_once(browser: Any, console: Console) -> None:
    """The scanner's picture, and what is done with it, while the page is restored."""
    with window(browser, console.start()) as page:
        begin(page)
        page.keyboard.press(" ")
        page.wait_for_function(WAITING, timeout=WAIT_MS)
        page.wait_for_selector("#strip-1[data-level=green]", timeout=WAIT_MS)
        assert page.locator(".shot-waiting").is_hidden()
        assert "/page/full" in str(page.locator(".shot-link img").get_attribute("src"))


@pytest.mark.parametrize(
    "way", ["window closed", *(pytest.param(way, marks=pytest.mark.slow) for way in ("network pulled", *ASLEEP))]
)
def test_a_shot_is_kept_whatever_becomes_of_the_window(browser: Any, console: Console, way: str) -> None:
    """The laser goes off and the frame is stored: the server does not need the page for either."""
    with ExitStack() as stack:
        page = stack.enter_context(window(browser, link := console.start(LONG_SHOT_S)))
        begin(page)
        page.keyboard.press(" ")
        page.wait_for_selector("[data-laser=on]")
        if way == "network pulled":
            page.context.set_offline(True)
            lost(page)
            page.wait_for_timeout(1500)
            page.context.set_offline(False)
        elif way == "window closed":
            page.context.close()
            page = stack.enter_context(window(browser, link))
        elif way == "server asleep":
            with standing_still([console.processes[-1].pid]):
                lost(page)
            back(page)
        else:
            with standing_still(chromium_processes()):
                wait_for(lambda: len(stored_pages(console)) == 1, "the frame")
                time.sleep(ASLEEP_S)
            back(page)
        page.wait_for_selector("[data-laser=off]", timeout=READY_MS)
        page.evaluate("location.hash = '#/capture'")
        page.wait_for_selector("#strip-1[data-level=green]", timeout=WAIT_MS)
    assert [page.capture is not None for page in stored_pages(console)] == [True]
    console.kill(signal.SIGTERM)
    assert verify(console.folder / "missale-romanum").problems == ()


def lost(page: Page) -> None:
    """Wait until a page says that it does not hear its server, and that it cannot know about the laser."""
    page.get_by_text("No connection to Planish.").first.wait_for()
    assert page.locator(".laser").inner_text() == "Laser unknown"


def back(page: Page) -> None:
    """Wait until a page says that it was without its server, and for how long."""
    reported = page.locator(".notice", has_text="Planish answers again.")
    reported.wait_for()
    assert re.search(r"Nothing was heard of it for \d+ s\.", reported.inner_text())
    page.get_by_text("No connection to Planish.").first.wait_for(state="detached")


def stored_pages(console: Console) -> list[Any]:
    """The pages of the session that a console has made."""
    return list(read_session(console.folder / "missale-romanum").history.pages())


def chromium_processes() -> list[int]:
    """The processes of the browser that this one has started."""
    return [one.pid for one in psutil.Process().children(recursive=True) if "chrom" in one.name()]


@contextmanager
def standing_still(processes: list[int]) -> Iterator[None]:
    """Processes that do nothing for the time of a block, as when their computer sleeps."""
    assert processes
    for number in processes:
        os.kill(number, signal.SIGSTOP)
    try:
        yield
    finally:
        for number in processes:
            os.kill(number, signal.SIGCONT)


@pytest.mark.slow
def test_the_link_of_an_earlier_start_does_not_open(browser: Any, console: Console) -> None:
    old = console.start()
    console.kill(signal.SIGTERM)
    link = console.start()
    with window(browser, link) as page:
        page.goto(re.sub(r"token=.*", old.split("token=")[1], link.replace("enter?", "enter?token=")))
        assert "link" in page.locator("body").inner_text()

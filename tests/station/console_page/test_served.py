"""A console that is served, in a browser: a second window, a shot whose window goes, the link of an earlier start."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from oracles.console.browser import READY_MS, window
from station.session import read_session

if TYPE_CHECKING:
    from playwright.sync_api import Page

WAIT_MS = 120_000  # for a restoration, on a machine with many at work: the first compiles or loads the kernels
END_S = 60.0


@dataclass
class Console:
    """A console of its own process, before a scanner that finds leaves of text."""

    folder: Path
    processes: list[subprocess.Popen[str]] = field(default_factory=list)

    def start(self) -> str:
        """Start it; returns its link."""
        command = [sys.executable, "-m", "oracles.console.leaves", str(self.folder)]
        self.processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        assert self.processes[-1].stdout is not None
        return self.processes[-1].stdout.readline().strip()

    def kill(self, number: int = signal.SIGKILL) -> None:
        """End it by a signal."""
        self.processes[-1].send_signal(number)
        self.processes[-1].wait(END_S)

    def close(self) -> None:
        """End whatever is left."""
        for process in self.processes:
            if process.poll() is None:
                process.terminate()
                process.wait(END_S)
            assert process.stdout is not None
            process.stdout.close()


@pytest.fixture
def console(tmp_path: Path) -> Iterator[Console]:
    started = Console(tmp_path)
    try:
        yield started
    finally:
        started.close()


def begin(page: Page, title: str = "Missale Romanum") -> None:
    """Make a session and go to the shoot screen."""
    page.get_by_role("button", name="New session").first.click()
    page.get_by_label("Title of the volume").fill(title)
    page.get_by_role("button", name="Begin").click()
    page.get_by_text("Ready for the first page").wait_for()


def shoot(page: Page, number: int, key: str = " ") -> None:
    """Shoot, and wait until the page is stored."""
    before = page.locator(f"#strip-{number}").count()
    page.locator("[data-action=shoot]:not([aria-disabled])").wait_for()
    page.keyboard.press(key)
    page.wait_for_selector("[data-laser=on]")
    page.wait_for_selector("[data-laser=off]", timeout=WAIT_MS)
    if not before:
        page.wait_for_selector(f"#strip-{number}", timeout=WAIT_MS)


def test_a_second_window_watches_until_it_takes_over(browser: Any, console: Console) -> None:
    with window(browser, console.start()) as first:
        begin(first)
        second = first.context.new_page()
        second.goto(first.url)
        second.get_by_text("This window only watches.").wait_for()
        assert second.locator("[data-action=shoot]").get_attribute("aria-disabled") == "true"
        shoot(first, 1)
        second.wait_for_selector("#strip-1", timeout=WAIT_MS)
        second.get_by_role("button", name="Take control").click()
        first.get_by_text("This window only watches.").wait_for()
        assert first.locator("[data-action=shoot]").get_attribute("aria-disabled") == "true"


@pytest.mark.parametrize("way", ["network pulled", "window closed"])
def test_a_shot_is_kept_whatever_becomes_of_the_window(browser: Any, console: Console, way: str) -> None:
    """The laser goes off and the frame is stored: the server does not need the page for either."""
    with ExitStack() as stack:
        page = stack.enter_context(window(browser, link := console.start()))
        begin(page)
        page.keyboard.press(" ")
        page.wait_for_selector("[data-laser=on]")
        if way == "network pulled":
            page.context.set_offline(True)
            page.get_by_text("No connection to Planish.").first.wait_for()
            assert page.locator(".laser").inner_text() == "Laser unknown"
            page.wait_for_timeout(1500)
            page.context.set_offline(False)
        else:
            page.context.close()
            page = stack.enter_context(window(browser, link))
        page.wait_for_selector("[data-laser=off]", timeout=READY_MS)
        page.evaluate("location.hash = '#/shoot'")
        page.wait_for_selector("#strip-1", timeout=WAIT_MS)
    assert len(list(read_session(console.folder / "missale-romanum").history.pages())) == 1


def test_the_link_of_an_earlier_start_does_not_open(browser: Any, console: Console) -> None:
    old = console.start()
    console.kill(signal.SIGTERM)
    link = console.start()
    with window(browser, link) as page:
        page.goto(re.sub(r"token=.*", old.split("token=")[1], link.replace("enter?", "enter?token=")))
        assert "link" in page.locator("body").inner_text()

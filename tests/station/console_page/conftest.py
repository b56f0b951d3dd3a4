"""A browser for the tests of the console's page. A module has its own: its loop may not outlive it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING

import pytest

from oracles.console import CannedStation, serving
from oracles.console.browser import READY_MS, chromium, find_chromium, window
from station.console.vendored import PAGE, missing_files
from tests.conftest import GRACE_SECONDS

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

Open = Callable[..., "Page"]
CONNECTED = ".laser:not([data-laser=unknown])"
# All is loaded when the page opens, and once more when it hears the server; the preview comes last.
LOADED = """() =>
  performance.getEntriesByType("resource").filter((one) => one.name.includes("/api/preview")).length > 1"""


@pytest.fixture(autouse=True)
def _no_leaks() -> Iterator[None]:
    """In place of the check of all tests: a browser starts and ends processes as it likes."""
    before = set(threading.enumerate())
    yield
    deadline = time.monotonic() + GRACE_SECONDS
    while left := [one.name for one in set(threading.enumerate()) - before if not _is_kept(one)]:
        assert time.monotonic() < deadline, left
        time.sleep(0.01)


def _is_kept(thread: threading.Thread) -> bool:
    """Whether a thread may outlive a test: a daemon, or one of Playwright's."""
    return thread.daemon or thread.name.startswith("asyncio_")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    pytest.importorskip("playwright", reason="needs the package playwright")
    if find_chromium() is None:
        pytest.skip("needs the system package chromium")
    if missing := missing_files():
        pytest.skip(f"needs {', '.join(missing)}: run python -m station.console.vendored")
    with chromium() as started:
        yield started


@pytest.fixture(scope="session")
def axe() -> str:
    return (PAGE / "vendor/test/axe.min.js").read_text("utf-8")


@pytest.fixture
def canned() -> CannedStation:
    return CannedStation(PAGE)


@pytest.fixture
def show(browser: Browser) -> Iterator[Open]:
    """Shows a screen of a canned station in a new window."""
    with ExitStack() as stack:

        def opened(station: CannedStation, screen: str = "capture", **look: object) -> Page:
            page = stack.enter_context(window(browser, f"{stack.enter_context(serving(station))}/#/{screen}", **look))
            page.locator(CONNECTED).wait_for(timeout=READY_MS)  # keys that come before do nothing
            page.wait_for_function(LOADED, timeout=READY_MS)
            return page

        yield opened


def until(page: Page, come: Callable[[], object]) -> None:
    """Wait for what comes to this process: `page` brings it."""
    deadline = time.monotonic() + READY_MS / 1000
    while not come():
        assert time.monotonic() < deadline, "it did not come"
        page.wait_for_timeout(10)

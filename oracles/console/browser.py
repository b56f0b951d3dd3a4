"""The system's Chromium, without a window and without a way to anything but this computer."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

READY_MS = 30_000  # on a machine with many at work
OPEN_MS = 120_000  # for all files of the page, with a cold cache and beside others
NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--no-sandbox",  # a container's root has none
    "--disable-gpu",  # WebGL is drawn in software
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


def find_chromium() -> str | None:
    """The path of the system's Chromium, None when it has none."""
    return next((path for name in NAMES if (path := shutil.which(name))), None)


@contextmanager
def chromium() -> Iterator[Browser]:
    """A headless Chromium; its contexts are windows that know nothing of each other."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), headless=True, args=list(OPTIONS))
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def window(
    browser: Browser,
    address: str,
    *,
    theme: str = "dark",
    language: str = "en",
    size: tuple[int, int] = (1280, 800),
) -> Iterator[Page]:
    """A window that shows the console, ready. Raises AssertionError at the end for an error on its page."""
    context = browser.new_context(viewport={"width": size[0], "height": size[1]}, reduced_motion="reduce")
    context.add_init_script(
        f"localStorage['planish-theme'] ??= '{theme}'; localStorage['planish-language'] ??= '{language}';"
    )
    context.set_default_navigation_timeout(OPEN_MS)
    page = context.new_page()
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda line: faults.append(line.text) if "Content Security Policy" in line.text else None)
    try:
        page.goto(address)
        page.wait_for_selector("[data-ready]", timeout=OPEN_MS)
        yield page
    finally:
        context.close()
    assert faults == [], faults


def violations(page: Page, axe: str) -> list[str]:
    """What axe finds wrong on a page as it stands: rule, and the elements. axe: its source."""
    page.evaluate(axe)
    found = page.evaluate("axe.run(document, {resultTypes: ['violations']})")
    return [
        f"{one['id']}: "
        + "; ".join(f"{' '.join(node['target'])} {node['failureSummary'][:300]}" for node in one["nodes"])
        for one in found["violations"]
    ]


def server_answer(page: Page, path: str) -> dict[str, Any]:
    """What the server of a window answers to it."""
    return dict(page.evaluate("async (path) => (await import('/page/js/api.js')).get(path)", path))

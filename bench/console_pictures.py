"""`python -m bench.console_pictures [FOLDER]`: screenshots of the web interface while a session is captured.

Chromium works a shift before the simulated scanner: pages of a volume, one of them cut off, a preview, settings, a
server that is killed, its recovery, an export. Whatever is seen was made by the server.
"""

from __future__ import annotations

import io
import sys
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from PIL import Image

from oracles.console.browser import chromium, window
from oracles.console.process import Console, console_of

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

DOCS = Path(__file__).parents[1] / "docs" / "images" / "console"
TABLET = (800, 1280)  # of ten inches, standing
WAIT_MS = 600_000  # for a restoration, the first of which compiles
SETTLED_MS = 1500  # for tiles and pictures to be drawn
COLOURS = 256  # of a picture: half the bytes, and no difference that is seen
PAGES = 3  # the last one is cut off
TOOLS = {  # and what shows that it is there
    "Compare": ".compare-handle[data-ready]",
    "Words": ".words text",
    "3D": ".model-status:has-text('triangles')",
}
HANDS = {
    "Spine": ".spine-tool p:not(:empty)",
    "Crop": ".crop-tool li",
    "Rotation": ".turn-tool li",
    "Light": ".light-tool li",
}
THEMES: dict[str, dict[str, str]] = {"dark": {}, "light": HANDS}  # and the tools that are shown in them
Keep = Callable[["Page", str], None]


def main(folder: Path = DOCS) -> int:
    """Write every picture into a folder."""

    def keep(page: Page, name: str) -> None:
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(SETTLED_MS)
        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        picture.quantize(COLOURS, dither=Image.Dither.NONE).save(folder / f"{name}.png", optimize=True)
        print(f"{name}.png", flush=True)

    with tempfile.TemporaryDirectory() as root, chromium() as browser, console_of(Path(root), "volume") as console:
        with window(browser, link := console.start()) as page:
            _session(page, "Herbarius")
            _session(page, "Missale Romanum")
            _shift(page, keep)
            _page_view(page, keep)
            _settings(page, keep)
            for theme in THEMES:
                _hand(page, theme, keep)
        _tablet(browser, link, keep)
        _crash(browser, console, link, keep)
    return 0


def _session(page: Page, title: str) -> None:
    page.evaluate("location.hash = '#/sessions'")
    page.get_by_role("button", name="New session").first.click()
    page.get_by_label("Title of the volume").fill(title)
    page.get_by_label("Project").fill("P 1612")
    page.get_by_label("Read the words").check()
    page.get_by_role("button", name="Begin").click()
    page.get_by_text("Ready for the first page").wait_for()


def _shoot(page: Page, number: int) -> None:
    page.locator("[data-action=capture]:not([aria-disabled])").wait_for(timeout=WAIT_MS)
    page.keyboard.press(" ")
    page.wait_for_selector("[data-laser=on]", timeout=WAIT_MS)
    page.wait_for_selector(f"#strip-{number}", timeout=WAIT_MS)


def _checked(page: Page, number: int) -> None:
    page.wait_for_selector(f"#strip-{number}[data-level]:not([data-level='']):not([data-busy])", timeout=WAIT_MS)
    page.wait_for_selector(".light", timeout=WAIT_MS)


def _shift(page: Page, keep: Keep) -> None:
    """Pages, the last of which is cut off; a preview while the next one is shot."""
    for number in range(1, PAGES + 1):
        _shoot(page, number)
        if number == 1:
            page.wait_for_selector(".shot-waiting:visible", timeout=WAIT_MS)
            keep(page, "first-shot-dark")
        _checked(page, number)
        if number == PAGES:
            keep(page, "capture-dark")
        else:
            page.keyboard.press("Enter")
            page.wait_for_selector(f"#strip-{number}[aria-label*=accepted]", timeout=WAIT_MS)
    page.keyboard.press("p")
    page.wait_for_selector(".overlay:visible", timeout=WAIT_MS)
    page.wait_for_selector("[data-action=capture]:not([aria-disabled])", timeout=WAIT_MS)
    page.keyboard.press(" ")
    page.wait_for_selector("[data-laser=on]", timeout=WAIT_MS)
    page.get_by_role("button", name="Preview").first.click()
    page.screenshot()  # the first one of a page takes longest
    keep(page, "preview-dark")
    _checked(page, PAGES + 1)


def _page_view(page: Page, keep: Keep) -> None:
    page.evaluate("location.hash = '#/page/2'")
    page.wait_for_selector(".tiles canvas", timeout=WAIT_MS)
    for name, sign in TOOLS.items():
        page.get_by_role("group", name="Tools").get_by_role("button", name=name).click()
        page.wait_for_selector(sign, state="attached", timeout=WAIT_MS)
        keep(page, f"page-{name.lower()}-dark")


def _hand(page: Page, theme: str, keep: Keep) -> None:
    """The tools for corrections, an outline that is drawn on the scanner's image, the contact sheet."""
    page.evaluate("(theme) => { localStorage['planish-theme'] = theme; location.hash = '#/page/2'; }", theme)
    page.reload()
    page.locator(".page-screen .light").first.wait_for(timeout=WAIT_MS)
    tools = page.get_by_role("group", name="Tools")
    for tool, sign in THEMES[theme].items():
        tools.get_by_role("button", name=tool, exact=True).click()
        page.locator(sign).first.wait_for(timeout=WAIT_MS)
        keep(page, f"page-{tool.lower()}-{theme}")
    tools.get_by_role("button", name="Outline").click()
    page.locator(".page-viewer[data-scan]").wait_for(timeout=WAIT_MS)
    page.keyboard.press("d")
    page.locator(".handle").nth(3).wait_for()
    keep(page, f"page-outline-{theme}")
    page.keyboard.press("Escape")
    page.evaluate("location.hash = '#/sheet'")
    page.locator("#leaf-0").wait_for()
    keep(page, f"sheet-{theme}")


def _settings(page: Page, keep: Keep) -> None:
    page.evaluate("location.hash = '#/settings'")
    page.get_by_role("spinbutton", name="Distance").fill("880")
    page.get_by_text("Not in use yet: 1").wait_for()
    keep(page, "settings-dark")
    page.get_by_role("button", name="Drop changes").click()


def _tablet(browser: Browser, link: str, keep: Keep) -> None:
    with window(browser, link, theme="light", language="de", size=TABLET) as page:
        page.get_by_role("button", name="Übernehmen").click()
        page.wait_for_selector(".light", timeout=WAIT_MS)
        keep(page, "tablet-light")


def _crash(browser: Browser, console: Console, link: str, keep: Keep) -> None:
    """A server that is killed while a page is restored; what the next one finds; an export."""
    with ExitStack() as stack:
        page = stack.enter_context(window(browser, link))
        _shoot(page, PAGES + 2)
        console.kill()
        page = stack.enter_context(window(browser, console.start()))
        page.locator("[data-name=missale-romanum]").get_by_role("button", name="Open", exact=True).click()
        page.get_by_role("heading", name="Nothing is lost").wait_for(timeout=WAIT_MS)
        keep(page, "recovery-dark")
        page.get_by_role("button", name="Continue capturing").click()
        _checked(page, PAGES + 2)
        page.evaluate("location.hash = '#/sessions'")
        page.wait_for_selector(".session")
        keep(page, "sessions-dark")
        page.evaluate("location.hash = '#/export'")
        page.locator("option", has_text="Missale Romanum").wait_for(state="attached")
        page.get_by_role("button", name="Deliver and check").click()
        page.get_by_text("The validator found it correct").wait_for(timeout=WAIT_MS)
        keep(page, "export-dark")


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))

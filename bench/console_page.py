"""`python -m bench.console_page`: how fast the console's page is in the system's Chromium, drawing in software.

First screen: from the answer of the server to the screen, and the processor time of the browser for it. Turning:
frames in a second of a scan of 307,200 points on a canvas of the stated size. Strip: frames while 1,000 pages scroll
by. Contact sheet: from the key to its first leaves, and frames while it scrolls. Shot: from the key to the stored
page and on to its verdict, on the screen, of small leaves of text and of FINE pages from the simulated scanner. The
load of the machine is printed beside them: on one with others at work the figures say little.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from statistics import median
from typing import TYPE_CHECKING

import psutil

from oracles.console import CannedStation, serving
from oracles.console.browser import chromium, window
from station.console.vendored import PAGE

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

DENSE, PAGES, RUNS, SHOTS = 307_200, 1000, 5, 4
READY_S = 15.0  # in which the process that restores has loaded its libraries
SERVE = ("--config", "configs/simulated.toml", "--port", "0", "--index", "{folder}/index")
TURN_S, SCROLL_PX = 4.0, 58  # half a page of the strip for each frame
READY = """() => {
  const [load] = performance.getEntriesByType("navigation");
  const [ready] = performance.getEntriesByName("planish-ready");
  return ready.startTime - load.responseStart;
}"""
FRAMES = """async (ms) => {
  const canvas = [...document.querySelectorAll(".model-canvas")].find((one) => !one.hidden);
  const [before, start] = [Number(canvas.dataset.frames), performance.now()];
  await new Promise((done) => setTimeout(done, ms));
  const frames = Number(canvas.dataset.frames) - before;
  return { frames, seconds: (performance.now() - start) / 1000, size: `${canvas.width} × ${canvas.height}` };
}"""
# Waiting for a selector looks twice a second only.
APPEARS = """(selector) => new Promise((done) => {
  const look = () => {
    if (!document.querySelector(selector)) return;
    observer.disconnect();
    done();
  };
  const observer = new MutationObserver(look);
  observer.observe(document.body, { subtree: true, childList: true, attributes: true });
  look();
})"""
SCROLL = """async (step) => {
  const strip = document.querySelector(".strip-scroller");
  strip.scrollLeft = 0;
  const gaps = [];
  let before = performance.now();
  for (let at = 0; at < strip.scrollWidth - strip.clientWidth; at += step * 10) {
    strip.scrollLeft = at;
    const now = await new Promise(requestAnimationFrame);
    gaps.push(now - before);
    before = now;
  }
  gaps.sort((one, two) => one - two);
  return { frames: gaps.length, median: gaps[gaps.length >> 1], late: gaps[Math.floor(gaps.length * 0.99)] };
}"""

# Those of 50 ms and more, in ms (W3C, Long Tasks API).
LONG_TASKS = """() => {
  window.longTasks = [];
  new PerformanceObserver((list) => longTasks.push(...list.getEntries().map((one) => one.duration)))
    .observe({ type: "longtask" });
}"""
SCROLL_SHEET = (
    SCROLL.replace(".strip-scroller", ".sheet-scroller")
    .replace("scrollLeft", "scrollTop")
    .replace("scrollWidth", "scrollHeight")
    .replace("clientWidth", "clientHeight")
)


def main() -> int:
    """Print the figures."""
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    with chromium() as browser:
        with serving(CannedStation(PAGE, pages=PAGES, points=DENSE)) as address:
            _first_screen(browser, address)
            with window(browser, f"{address}/#/page/3") as page:
                _turning(page)
                _strip(page)
                _sheet(page)
        _shots(browser, "leaf", ["oracles.console.leaves", "{folder}"])
        _shots(browser, "FINE page", ["station", "serve", "{folder}", *SERVE])
    return 0


def _first_screen(browser: Browser, address: str) -> None:
    times, processor = [], []
    for _ in range(RUNS):
        before = _processor_s()
        with window(browser, address) as page:
            times.append(page.evaluate(READY))
            processor.append(_processor_s() - before)
    printed = f"{median(times):.0f} ms (best {min(times):.0f} ms)"
    print(f"first screen ready after the server's answer: {printed}; processor time {median(processor):.2f} s")


def _turning(page: Page) -> None:
    page.get_by_role("group", name="Tools").get_by_role("button", name="3D").click()
    page.get_by_role("group", name="What is shown").get_by_role("button", name="Points").click()
    page.get_by_text(f"{DENSE:,} measured points").wait_for()
    page.get_by_role("button", name="Turn the model").click()
    before = _processor_s()
    found = page.evaluate(FRAMES, TURN_S * 1000)
    spent = (_processor_s() - before) / max(found["frames"], 1)
    rate = found["frames"] / found["seconds"]
    what = f"turning {DENSE:,} points on {found['size']} px"
    print(f"{what}: {rate:.1f} frames/s; processor time {1000 * spent:.1f} ms each")
    page.get_by_role("button", name="Turn the model").click()


def _strip(page: Page) -> None:
    found = page.evaluate(SCROLL, SCROLL_PX)
    figures = f"{found['median']:.1f} ms between frames, {found['late']:.1f} ms in the slowest hundredth"
    print(f"strip of {PAGES:,} pages, {found['frames']} frames: {figures}")


def _sheet(page: Page) -> None:
    page.evaluate(f"location.hash = '#/page/{PAGES // 2}'")
    page.evaluate(APPEARS, ".page-screen .light")
    page.evaluate(LONG_TASKS)
    start = time.perf_counter()
    page.keyboard.press("g")
    page.evaluate(APPEARS, "#leaf-0")
    painted = time.perf_counter() - start
    found = page.evaluate(SCROLL_SHEET, SCROLL_PX)
    figures = f"{found['median']:.1f} ms between frames, {found['late']:.1f} ms in the slowest hundredth"
    longest = max(page.evaluate("longTasks"), default=0.0)
    print(f"contact sheet of {PAGES:,} leaves: painted after {painted:.2f} s; {found['frames']} frames, {figures}")
    print(f"longest task while it was painted and scrolled: {longest:.0f} ms (0: none over 50)")


def _shots(browser: Browser, what: str, command: Sequence[str]) -> None:
    """Shoot pages at a console that a module serves, and print how long each took; it prints its link first."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", *(word.format(folder=folder) for word in command)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as server:
            try:
                assert server.stdout is not None
                with window(browser, server.stdout.readline().strip()) as page:
                    _shift(page, what)
            finally:
                server.terminate()


def _shift(page: Page, what: str) -> None:
    page.get_by_role("button", name="New session").first.click()
    page.get_by_label("Title of the volume").fill("Bench")
    page.get_by_role("button", name="Begin").click()
    page.get_by_text("Ready for the first page").wait_for()
    time.sleep(READY_S)
    for number in range(1, SHOTS + 1):
        start = time.perf_counter()
        page.keyboard.press(" ")
        page.evaluate(APPEARS, f"#strip-{number}")
        stored = time.perf_counter() - start
        page.evaluate(APPEARS, f"#strip-{number}[data-level]:not([data-level=''])")
        checked = time.perf_counter() - start
        print(f"{what} {number}: stored after {stored:.2f} s, checked {checked - stored:.2f} s later")


def _processor_s() -> float:
    """Processor time of all processes of the browser so far."""
    total = 0.0
    for child in psutil.Process().children(recursive=True):
        try:
            times = child.cpu_times()
        except psutil.Error:  # it has just ended
            continue
        total += times.user + times.system
    return total


if __name__ == "__main__":
    sys.exit(main())

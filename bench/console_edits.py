"""`python -m bench.console_edits`: corrections through HTTP, from the request to the new picture.

A FINE opening in a session of a served station: light, rotation, crop, outline, area and spine, each until the picture
of its restoration has been sent; undo and redo, which compute nothing; a rotation after another page was restored, of
which nothing is kept; a rule over 300 pages. The load of the machine is printed, too: with others at work the figures
say little.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import httpx

from bench.console import served
from bench.scratch import scratch_folder
from drivers.simulated import Facing, Opening, shoot
from oracles.tiny_scan import tiny_scan
from station.session import Volume, add_scan, create_session, open_session
from station.session.terms.presets import load_preset

PAGES = 300
PAGE_MM = (260.0, 180.0)
INSET = 0.1  # of the picture: an outline round the middle of the opening
MOVED_PX = 6.0  # of the spine
POLL_S, WAIT_S = 0.02, 300.0
EDITS = "/api/pages/1/edits"


def main() -> int:
    """Print the figures."""
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    with scratch_folder() as folder:
        size = make_sessions(folder)
        with served(folder) as (station, _):
            browser = station.browser
            browser.post("/api/sessions/book/open").raise_for_status()
            wait_for(lambda: is_restored(browser))
            time_corrections(browser, size)
            browser.post("/api/sessions/two/open").raise_for_status()
            wait_for(lambda: is_restored(browser, 2))
            report("rotation, other page", lambda: correct(browser, both({"rotate_deg": 0.5})))
            browser.post("/api/sessions/many/open").raise_for_status()
            rule = {"scope": {"captures": "all"}, "edits": {"parts": {"page": {"turn": 1}}}}
            report(f"rule over {PAGES} pages", lambda: browser.post("/api/rules", json=rule).raise_for_status())
    return 0


def make_sessions(folder: Path) -> tuple[int, int]:
    """Make sessions of an opening, of two, and of PAGES scans; return the size of the picture, px."""
    scan, _ = shoot(Opening(), Facing(left_mm=PAGE_MM[0] / 2, seed=1), mode="fine", page_mm=PAGE_MM)
    values = load_preset("book").model_dump(mode="json", exclude_none=True)
    for name, scans in (("book", [scan]), ("two", [scan] * 2), ("many", [tiny_scan(1)] * PAGES)):
        create_session(folder / name, Volume(title=name, preset_values=values))
        with open_session(folder / name) as writer:
            for one in scans:
                add_scan(writer, one, facts={})
    assert scan.texture is not None
    height, width = scan.texture.shape[:2]
    return width, height


def time_corrections(browser: httpx.Client, size: tuple[int, int]) -> None:
    """Print the seconds of each kind of correction until its picture was sent, and of undo and redo."""
    left, top, right, bottom = INSET * size[0], INSET * size[1], (1 - INSET) * size[0], (1 - INSET) * size[1]
    outline = [[left, top], [right, top], [right, bottom], [left, bottom]]
    area = [[left, top], [left + 60, top], [left + 60, top + 60]]
    spine = [[x + MOVED_PX, y] for x, y in browser.get("/api/pages/1/layout").json()["spine"]]
    for name, edits in {
        "light": both({"settings": {"shading": "remove"}}),
        "rotation": both({"rotate_deg": 0.5}),
        "crop": both({"crop": {"mode": "margin", "margin_mm": 3.0}}),
        "outline": both({"outline": outline}),
        "area": both({"masks": [{"what": "remove", "polygon": area}]}),
        "spine": {"spine": spine},
    }.items():
        report(name, lambda edits=edits: correct(browser, edits))
    for action in ("undo", "redo"):
        before = browser.get(EDITS).json()["tag"]
        report(action, lambda action=action, before=before: press(browser, action, before))


def both(part: Mapping[str, Any]) -> dict[str, Any]:
    """Return corrections of both leaves."""
    return {"parts": {"left": part, "right": part}}


def correct(browser: httpx.Client, edits: Mapping[str, Any]) -> None:
    """Correct the opening, and wait until a picture of its new restoration has been sent."""
    tag = browser.get(EDITS).json()["tag"]
    browser.put(EDITS, json={"edits": edits}, headers={"If-Match": f'"{tag}"'}).raise_for_status()
    wait_for(lambda: is_restored(browser))
    show(browser)


def press(browser: httpx.Client, action: str, before: int) -> None:
    """Undo or redo, and wait until the restoration that fits has been sent."""
    browser.post("/api/press", json={"action": action}).raise_for_status()
    wait_for(lambda: browser.get(EDITS).json()["tag"] != before and is_restored(browser))
    show(browser)


def show(browser: httpx.Client) -> None:
    """Load the picture of the first leaf in the size of a screen."""
    page = browser.get("/api/pages/1").json()
    leaf = page["leaves"][0]
    browser.get(f"/api/pictures/{page['restore']}/{leaf['prefix']}page/full").raise_for_status()


def is_restored(browser: httpx.Client, page: int = 1) -> bool:
    """Whether a page is restored as it is corrected now."""
    return browser.get(f"/api/pages/{page}/edits").json()["outdated"] is False


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds. Raises TimeoutError."""
    deadline = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"nothing came within {WAIT_S:g} s")
        time.sleep(POLL_S)


def report(name: str, work: Callable[[], object]) -> None:
    """Print how long a piece of work takes."""
    start = time.perf_counter()
    work()
    print(f"{name:<24} {time.perf_counter() - start:6.2f} s", flush=True)


if __name__ == "__main__":
    sys.exit(main())

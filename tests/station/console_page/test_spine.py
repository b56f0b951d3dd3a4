"""A spine that is moved in the browser, at a served console: the widths of both leaves follow it."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import griddata

from drivers.simulated import Facing, Opening, Truth, shoot
from oracles.console.browser import server_answer, window
from oracles.console.process import Console
from restore import RangeScan
from station.session import Volume, add_scan, create_session, open_session
from station.session.terms.presets import load_preset
from tests.station.console.conftest import wait_for
from tests.station.console_page.test_served import WAIT_MS, console

__all__ = ["console"]

PAGE_MM = (260.0, 180.0)
MOVED_PX = 4  # of the picture: nearly 3 mm on the paper, which is steep there
WIDTH_MM = 0.1  # by which the width of a leaf without the fold may differ from what the spine was moved by
FOLD_MM = 0.3  # of the leaf that the fold falls to: it is fitted as one smooth sheet across it


def add_opening(folder: Path) -> tuple[RangeScan, Truth]:
    """Make a session of one opened book that is not restored yet."""
    scan, truth = shoot(Opening(), Facing(left_mm=PAGE_MM[0] / 2, seed=1128), seed=1128, page_mm=PAGE_MM)
    values = load_preset("book").model_dump(mode="json", exclude_none=True)
    create_session(folder / "book", Volume(title="Book", preset_values=values))
    with open_session(folder / "book") as writer:
        add_scan(writer, scan, facts={})
    return scan, truth


def paper_x(scan: RangeScan, truth: Truth, line: Any) -> float:
    """Where a line from head to tail, px of the picture, lies on the paper: mm from its left side, as a mean."""
    seen = np.isfinite(truth.flat).all(axis=2)
    x, y = np.asarray(line, float).T
    down = np.linspace(y[0], y[-1], 50)
    points = np.column_stack([np.interp(down, y, x), down])
    return float(np.nanmean(griddata(scan.texture_xy[seen], truth.flat[seen][:, 0], points)))


def restored(page: Any) -> dict[str, Any]:
    """The corrections of the page, when it is restored as it is corrected."""

    def found() -> dict[str, Any] | None:
        page.wait_for_timeout(200)  # the restoration has the processor
        answer = server_answer(page, "/api/pages/1/edits")
        return answer if answer["restore"] and not answer["outdated"] else None

    return dict(wait_for(found, "the restoration", within=WAIT_MS / 1000))


def saved(page: Any) -> dict[str, Any]:
    """Save the draft, and return the corrections when the page is restored with them."""
    page.locator(".handle").first.wait_for()
    page.keyboard.press("Enter")
    page.get_by_text("Saved; the page is restored again", exact=True).wait_for()
    return restored(page)


def change_of_width(before: dict[str, Any], after: dict[str, Any], part: str) -> float:
    return float(after["parts"][part][0] - before["parts"][part][0])


@pytest.mark.slow
def test_a_spine_that_is_moved_moves_both_widths(browser: Any, console: Console) -> None:
    scan, truth = add_opening(console.folder)
    with window(browser, console.start()) as page:
        page.get_by_role("button", name="Open", exact=True).click()
        page.get_by_role("heading", name="Nothing is lost").wait_for(timeout=WAIT_MS)
        restored(page)
        page.evaluate("location.hash = '#/page/1'")
        page.locator(".tiles canvas").first.wait_for()
        page.keyboard.press("s")
        found = page.get_by_text("mm from the left")
        found.wait_for(timeout=WAIT_MS)
        assert re.search(r"± (0\.[1-9]|[1-9][\d.]*) mm at least", found.inner_text())
        page.keyboard.press("d")  # where it was found, in whole pixels
        before = saved(page)
        for _ in range(MOVED_PX):
            page.keyboard.press("ArrowLeft")
        after = saved(page)
    console.kill(signal.SIGTERM)
    assert console.processes[-1].returncode == 128 + signal.SIGTERM  # and not aborted by the C library
    drawn, moved = before["edits"]["spine"], after["edits"]["spine"]
    assert moved == [[x - MOVED_PX, y] for x, y in drawn]
    by = paper_x(scan, truth, drawn) - paper_x(scan, truth, moved)
    assert by == pytest.approx(3.0, abs=0.5)
    assert change_of_width(before, after, "left") == pytest.approx(-by, abs=WIDTH_MM)
    assert change_of_width(before, after, "right") == pytest.approx(by, abs=FOLD_MM)

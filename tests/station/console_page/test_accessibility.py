"""axe finds nothing on any screen, in both themes: WCAG 2.2 AA as far as a program can tell."""

from __future__ import annotations

import pytest

from oracles.console import preview
from oracles.console.answers import ANSWERS
from oracles.console.browser import violations

TOOLS = {  # and what shows that it is there
    "Look": ".tiles canvas",
    "Compare": ".compare-handle[data-ready]",
    "Ruler": ".crosshair",
    "Words": ".words text",
    "3D": ".model-told:has-text('triangles')",
}
RECOVERY = {"completed": True, "resumed": [9, 10], "left": 1, "problem": None}
DONE = {"started": None, "ended": None, "items": [], "error": None, "stage": None}
JOBS = [
    {
        **DONE,
        **{
            "id": "1",
            "kind": "export",
            "state": "done",
            "done": 1.0,
            "about": {"session": "missale", "format": "bagit"},
        },
        "result": {
            "folder": "/srv/e",
            "files": 9,
            "bytes": 10**8,
            "missing": ["page 3: words"],
            "valid": True,
            "problems": [],
        },
    },
    {
        **DONE,
        **{
            "id": "2",
            "kind": "batch",
            "state": "running",
            "done": 0.4,
            "about": {"sessions": ["herbal"]},
            "result": None,
        },
        "items": [
            {"name": "herbal 1", "state": "done", "text": ""},
            {"name": "herbal 2", "state": "running", "text": ""},
        ],
    },
]


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize(("screen", "ready"), [("shoot", ".light"), ("sessions", ".session"), ("settings", ".setting")])
def test_axe_finds_nothing(show, canned, axe, keep, theme, screen, ready):
    page = show(canned, screen, theme=theme)
    page.wait_for_selector(ready)
    page.wait_for_load_state("networkidle")
    keep(page, f"{screen}-{theme}")
    assert violations(page, axe) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_on_a_page_with_any_tool(show, canned, axe, keep, theme):
    canned.points = 60_000
    page = show(canned, "page/7", theme=theme)
    page.wait_for_selector(".light")
    for tool, sign in TOOLS.items():
        page.get_by_role("group", name="Tools").get_by_role("button", name=tool).click()
        page.wait_for_selector(sign, state="attached")
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(500)
        keep(page, f"page-{tool.lower()}-{theme}")
        assert violations(page, axe) == [], tool


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_on_jobs(show, canned, axe, keep, theme):
    canned.jobs = JOBS
    page = show(canned, "batch", theme=theme)
    for screen in ("batch", "export"):
        page.evaluate(f"location.hash = '#/{screen}'")
        page.wait_for_selector(".job")
        keep(page, f"{screen}-{theme}")
        assert violations(page, axe) == [], screen


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_when_things_go_wrong(show, canned, axe, keep, theme):
    canned.preview = preview()
    page = show(canned, "shoot", theme=theme)
    page.get_by_role("button", name="Preview").first.click()
    canned.change(scanner={"busy": "shoot", "laser": "on", "step": "scan", "done": 0.4})
    page.wait_for_selector("[data-laser=on]")
    page.wait_for_load_state("networkidle")
    keep(page, f"preview-{theme}")
    assert violations(page, axe) == []
    canned.change(
        scanner={
            "busy": None,
            "laser": "unknown",
            "problem": {"text": "the scanner does not answer.", "hint": "Switch it on."},
        },
        control={"tab": "f" * 32, "since": ANSWERS["row"]["captured"], "agent": "Firefox on Linux"},
        failed={"text": "the disk is full.", "hint": "Make room."},
    )
    page.wait_for_selector(".notice >> nth=3")
    keep(page, f"troubles-{theme}")
    assert violations(page, axe) == []
    canned.change(scanner={"laser": "off", "problem": None}, control={"tab": None}, failed=None, recovery=RECOVERY)
    page.evaluate("location.hash = '#/sessions'")
    page.wait_for_selector(".recovery")
    keep(page, f"recovery-{theme}")
    assert violations(page, axe) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_where_there_is_nothing_yet(show, canned, axe, theme):
    canned.pages, canned.sessions = 0, []
    canned.state["session"] = None
    page = show(canned, "shoot", theme=theme)
    for screen, sign in {
        "sessions": "No sessions yet",
        "batch": "No batch yet",
        "export": "Nothing delivered yet",
    }.items():
        page.evaluate(f"location.hash = '#/{screen}'")
        page.get_by_role("heading", name=sign).wait_for()
        assert violations(page, axe) == [], screen


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_on_dialogs(show, canned, axe, theme):
    page = show(canned, "shoot", theme=theme)
    page.wait_for_selector(".light")
    for key in ("?", "n"):
        page.keyboard.press(key)
        page.wait_for_selector("dialog[open]")
        assert violations(page, axe) == [], key
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog[open]", state="detached")


def test_axe_can_find_something(show, canned, axe):
    page = show(canned, "shoot")
    page.evaluate("document.querySelector('.brand-name').style.color = '#333'")
    page.evaluate("document.querySelector('#main').append(document.createElement('button'))")
    found = " ".join(violations(page, axe))
    assert "color-contrast" in found and "button-name" in found

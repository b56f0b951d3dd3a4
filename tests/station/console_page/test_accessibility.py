"""axe finds nothing on any screen, in both themes: WCAG 2.2 AA as far as a program can tell."""

from __future__ import annotations

import pytest

from oracles.console import preview
from oracles.console.answers import ANSWERS
from oracles.console.browser import violations

TOOLS = ("Look", "Compare", "Ruler", "Words", "3D")
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
def test_axe_finds_nothing(show, canned, axe, theme, screen, ready):
    page = show(canned, screen, theme=theme)
    page.wait_for_selector(ready)
    assert violations(page, axe) == []


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_on_a_page_with_any_tool(show, canned, axe, theme):
    page = show(canned, "page/7", theme=theme)
    page.wait_for_selector(".light")
    for tool in TOOLS:
        page.get_by_role("group", name="Tools").get_by_role("button", name=tool).click()
        page.wait_for_timeout(300)
        assert violations(page, axe) == [], tool


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_on_jobs(show, canned, axe, theme):
    canned.jobs = JOBS
    page = show(canned, "batch", theme=theme)
    for screen in ("batch", "export"):
        page.evaluate(f"location.hash = '#/{screen}'")
        page.wait_for_selector(".job")
        assert violations(page, axe) == [], screen


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_axe_finds_nothing_when_things_go_wrong(show, canned, axe, theme):
    canned.preview = preview()
    page = show(canned, "shoot", theme=theme)
    canned.change(
        scanner={"laser": "unknown", "problem": {"text": "the scanner does not answer.", "hint": "Switch it on."}},
        control={"tab": "f" * 32, "since": ANSWERS["row"]["captured"], "agent": "Firefox on Linux"},
        failed={"text": "the disk is full.", "hint": "Make room."},
    )
    page.get_by_role("button", name="Preview").first.click()
    page.wait_for_selector(".notice >> nth=3")
    assert violations(page, axe) == []
    canned.change(recovery=RECOVERY)
    page.evaluate("location.hash = '#/sessions'")
    page.wait_for_selector(".recovery")
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

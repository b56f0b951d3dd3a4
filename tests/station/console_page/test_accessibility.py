"""axe finds nothing on any screen, in both themes and languages: WCAG 2.2 AA as far as a program can tell."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest

from oracles.console import preview
from oracles.console.answers import ANSWERS
from oracles.console.browser import violations
from station.console.vendored import PAGE

TABLE = json.loads((PAGE / "strings.json").read_text("utf-8"))
LANGUAGES = ("en", "de")
LOOKS = (("dark", "en"), ("light", "de"))  # colours do not depend on words
TOOLS = {  # and what shows that it is there
    "look": ".tiles canvas",
    "compare": ".compare-handle[data-ready]",
    "ruler": ".crosshair",
    "words": ".words text",
    "model": ".model-status:not(:empty)",
    "spine": ".spine-tool p:not(:empty)",
    "outline": ".outline-tool li",
    "mask": ".mask-tool li",
    "crop": ".crop-tool li",
    "turn": ".turn-grid",
    "light": ".light-tool li",
}
ERROR = {"text": "the scanner does not answer.", "hint": "Switch it on.", "kinds": ["transport_error"]}
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


@dataclass(frozen=True)
class Look:
    """A theme and a language, in which windows are opened."""

    theme: str
    language: str

    @property
    def options(self) -> dict[str, str]:
        return {"theme": self.theme, "language": self.language}

    def text(self, key: str, **values: Any) -> str:
        """A text of the page in that language."""
        return str(TABLE[key][LANGUAGES.index(self.language)].format(**values))


@pytest.fixture(params=[LOOKS[0], pytest.param(LOOKS[1], marks=pytest.mark.slow)], ids="-".join)
def look(request: pytest.FixtureRequest) -> Look:
    return Look(*request.param)


@pytest.mark.parametrize(
    ("screen", "ready"), [("capture", ".light"), ("sessions", ".session"), ("settings", ".setting")]
)
def test_axe_finds_nothing(show, canned, axe, look, screen, ready):
    page = show(canned, screen, **look.options)
    page.wait_for_selector(ready)
    page.wait_for_load_state("networkidle")
    assert page.evaluate("document.documentElement.lang") == look.language
    assert violations(page, axe) == []


def test_axe_finds_nothing_on_a_page_with_any_tool(show, canned, axe, look):
    canned.points = 60_000
    page = show(canned, "page/7", **look.options)
    page.wait_for_selector(".light")
    for tool, sign in TOOLS.items():
        page.get_by_role("group", name=look.text("tools")).get_by_role("button", name=look.text(f"tool.{tool}")).click()
        page.wait_for_selector(sign, state="attached")
        page.wait_for_load_state("networkidle")
        page.wait_for_timeout(500)
        assert violations(page, axe) == [], tool


@pytest.mark.parametrize(("tool", "key"), [("s", "d"), ("o", "d"), ("x", "1"), ("c", "3")])
def test_axe_finds_nothing_on_points_that_are_drawn(show, canned, axe, look, tool, key):
    page = show(canned, "page/7", **look.options)
    page.wait_for_selector(".light")
    page.keyboard.press(tool)
    ready = (
        ".page-viewer[data-scan]" if tool in "ox" else ".spine-tool p:not(:empty)" if tool == "s" else ".crop-tool li"
    )
    page.wait_for_selector(ready)
    page.keyboard.press(key)
    page.wait_for_selector(".handle >> nth=1")
    assert violations(page, axe) == []


def test_axe_finds_nothing_on_a_draft_and_on_the_choice_of_its_pages(show, canned, axe, look):
    canned.rows[3] = {"asks": [{"name": "layout", "part": ""}]}
    page = show(canned, "page/7", **look.options)
    page.wait_for_selector(".light")
    page.keyboard.press("t")
    page.wait_for_selector(".turn-tool li")
    page.keyboard.press(".")
    page.wait_for_selector(".draft-lines li")
    assert violations(page, axe) == []
    own = {"pages": [7, 8], "own": {"8": ["page.turn"]}, "rule": 60}
    page.route("**/api/rules**", lambda route: route.fulfill(json=own))
    page.keyboard.press("a")
    page.wait_for_selector("dialog[open] li")
    assert violations(page, axe) == []
    page.get_by_role("dialog").get_by_role("checkbox", name=look.text("apply.over")).first.check()
    assert violations(page, axe) == []


def test_axe_finds_nothing_on_the_versions_of_two_windows(show, canned, axe, look):
    theirs = {**canned.leaves[0], "label": "v", "tag": 9}
    fault = {"error": {"key": "changed", "text": "changed", "hint": "", "data": {"current": theirs}}}
    page = show(canned, "page/7", **look.options)
    page.wait_for_selector(".light")
    page.keyboard.press("g")
    page.wait_for_selector("#leaf-0")
    page.wait_for_selector(".sheet-sizer:focus")
    page.route("**/api/leaves", lambda route: route.fulfill(status=412, json=fault))
    page.keyboard.press("F2")
    page.get_by_role("textbox", name=look.text("action.label")).fill("iv")
    page.keyboard.press("Enter")
    page.get_by_role("dialog", name=look.text("versions")).wait_for()
    assert violations(page, axe) == []


def test_axe_finds_nothing_on_a_page_without_a_model_and_on_one_that_was_not_restored(show, canned, axe, look):
    canned.unrecorded.add("mesh")
    canned.rows[8] = {"failed": {"text": "no page is in sight", "hint": "capture it again"}, "restore": None}
    page = show(canned, "page/7", **look.options)
    page.wait_for_selector(".light")
    page.get_by_role("group", name=look.text("tools")).get_by_role("button", name=look.text("tool.model")).click()
    page.get_by_role("heading", name=look.text("model.unrecorded")).wait_for()
    assert violations(page, axe) == []
    page.get_by_role("button", name=look.text("model.unrecorded.points")).click()
    page.wait_for_selector(".model-status:not(:empty)")
    page.locator("#strip-8").click()
    page.get_by_role("heading", name=look.text("page.failed")).wait_for()
    assert violations(page, axe) == []


def test_axe_finds_nothing_on_jobs(show, canned, axe, look):
    canned.jobs = JOBS
    page = show(canned, "batch", **look.options)
    for screen in ("batch", "export"):
        page.evaluate(f"location.hash = '#/{screen}'")
        page.wait_for_selector(".job")
        assert violations(page, axe) == [], screen


def test_axe_finds_nothing_when_things_go_wrong(show, canned, axe, look):
    canned.preview = preview()
    page = show(canned, "capture", **look.options)
    page.get_by_role("button", name=look.text("view.preview")).first.click()
    canned.change(scanner={"busy": "capture", "laser": "on", "step": "scan", "done": 0.4})
    page.wait_for_selector("[data-laser=on]")
    page.wait_for_load_state("networkidle")
    assert violations(page, axe) == []
    canned.change(
        scanner={"busy": None, "laser": "unknown", "problem": ERROR},
        control={"tab": "f" * 32, "since": ANSWERS["row"]["captured"], "agent": "Firefox on Linux"},
        failed={"text": "the disk is full.", "hint": "Make room.", "kinds": ["enospc", "os_error"]},
    )
    page.wait_for_selector(".notice >> nth=3")
    assert violations(page, axe) == []
    canned.change(scanner={"laser": "off", "problem": None}, control={"tab": None}, failed=None, recovery=RECOVERY)
    page.evaluate("location.hash = '#/sessions'")
    page.wait_for_selector(".recovery")
    assert violations(page, axe) == []


def test_axe_finds_nothing_while_the_first_page_is_restored_and_after_a_break(show, canned, axe, look):
    canned.pages = 1
    canned.rows[1] = {"busy": True, "restore": None, "level": ""}
    canned.state["session"]["current"] = 1
    page = show(canned, "capture", **look.options)
    page.get_by_text(look.text("shot.restoring", page=look.text("page.name", n=1))).wait_for()
    page.context.set_offline(True)
    page.get_by_text(look.text("offline.title")).first.wait_for()
    assert violations(page, axe) == []
    page.wait_for_timeout(2500)
    page.context.set_offline(False)
    page.get_by_text(look.text("back.title")).wait_for()
    assert violations(page, axe) == []


def test_axe_finds_nothing_where_there_is_nothing_yet(show, canned, axe, look):
    canned.pages, canned.sessions = 0, []
    canned.state["session"] = None
    page = show(canned, "capture", **look.options)
    for screen, sign in {"sessions": "session.none", "batch": "batch.none", "export": "export.none"}.items():
        page.evaluate(f"location.hash = '#/{screen}'")
        page.get_by_role("heading", name=look.text(sign)).wait_for()
        assert violations(page, axe) == [], screen


@pytest.mark.slow
def test_axe_finds_nothing_on_dialogs(show, canned, axe, look):
    page = show(canned, "capture", **look.options)
    for key, sign in {"?": ".light", "n": "[data-action=note]:not([aria-disabled])"}.items():
        page.wait_for_selector(sign)  # a station that was not heard for seconds, on a busy machine, is asked first
        page.keyboard.press(key)
        page.wait_for_selector("dialog[open]")
        assert violations(page, axe) == [], key
        page.keyboard.press("Escape")
        page.wait_for_selector("dialog[open]", state="detached")
    page.evaluate("location.hash = '#/sessions'")
    page.get_by_role("button", name=look.text("session.new")).first.click()
    page.wait_for_selector("dialog[open]")
    assert violations(page, axe) == []


def test_a_fault_is_said_in_the_language_of_the_reader_with_the_facts_of_the_server(show, canned):
    page = show(canned, "capture", language="de")
    canned.change(scanner={"laser": "off", "problem": ERROR}, session={"missing": ["between 2 and 5"]})
    notice = page.locator(".notice", has_text="Der Scanner meldet:")
    notice.wait_for()
    assert "Der Scanner antwortet nicht. Kabel und Strom prüfen" in notice.inner_text()
    assert notice.locator("[lang=en]").inner_text() == "(the scanner does not answer. Switch it on.)"
    assert "zwischen 2 und 5" in page.locator(".notice", has_text="Es fehlen Seiten").inner_text()
    canned.change(scanner={"problem": {**ERROR, "kinds": ["of_another_version"]}})
    page.locator(".notice", has_text="Der Scanner meldet: the scanner does not answer.").wait_for()


def test_axe_can_find_something(show, canned, axe):
    page = show(canned, "capture")
    page.evaluate("document.querySelector('.brand-name').style.color = '#333'")
    page.evaluate("document.querySelector('#main').append(document.createElement('button'))")
    found = " ".join(violations(page, axe))
    assert "color-contrast" in found and "button-name" in found

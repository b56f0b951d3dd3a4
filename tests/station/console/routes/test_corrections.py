"""Corrections through HTTP: a tag for each state, one writer, and nothing recorded for what cannot be."""

from __future__ import annotations

import json

import pytest

from restore import find_layout
from tests.station.conftest import curl_scan
from tests.station.console.conftest import wait_for
from tests.station.console.routes.test_pages import press, rows, shoot

EDITS = "/api/pages/1/edits"
TURNED = {"parts": {"page": {"turn": 1}}}


def put(browser, edits, tag, path=EDITS):
    return browser.put(path, json={"edits": edits}, headers={"If-Match": f'"{tag}"'})


def events(browser):
    return browser.get("/api/state").json()["session"]["events"]


def test_a_correction_is_recorded_restored_taken_back_and_has_its_tag(served, opened):
    shot = shoot(opened)
    capture = shot["capture"]
    assert opened.get("/api/pages/1").json()["before"] is None
    found = opened.get(EDITS)
    assert (found.headers["etag"], found.json()["edits"], found.json()["sources"]) == (f'"{capture}"', None, [])
    stored = put(opened, TURNED, capture)
    assert stored.status_code == 200
    assert stored.json()["sources"] == [{"source": "page", "edits": TURNED}]
    assert stored.headers["etag"] == opened.get(EDITS).headers["etag"] != found.headers["etag"]
    wait_for(lambda: opened.get(EDITS).json()["outdated"] is False, "the restoration")
    assert served.restorer.calls[-1]["edits"]["parts"] == TURNED["parts"]
    assert opened.get(EDITS).json()["restored"]["parts"] == TURNED["parts"]
    assert opened.get("/api/pages/1").json()["before"]["event"] == shot["restore"]
    press(opened, "undo")
    wait_for(lambda: opened.get(EDITS).headers["etag"] == f'"{capture}"', "the undo")
    assert opened.get(EDITS).json()["effective"] is None


def test_what_a_page_has_already_is_not_recorded_again(opened):
    tag = put(opened, TURNED, shoot(opened)["capture"]).json()["tag"]
    assert put(opened, TURNED, tag).json()["tag"] == tag
    recorded = [event["name"] for event in opened.get("/api/pages/1").json()["events"]]
    assert recorded.count("edits") == 1


def test_the_second_of_two_editors_gets_the_version_of_the_first(opened):
    tag = shoot(opened)["capture"]
    first = put(opened, TURNED, tag)
    refused = put(opened, {"layout": "split"}, tag)
    assert (refused.status_code, refused.headers["etag"]) == (412, first.headers["etag"])
    assert refused.json()["error"]["key"] == "changed"
    assert refused.json()["error"]["data"]["current"]["edits"] == TURNED
    assert opened.get(EDITS).json()["edits"] == TURNED
    assert put(opened, {"layout": "split"}, first.json()["tag"]).status_code == 200


def test_a_draft_of_an_earlier_scan_is_not_put_on_the_next_one(opened):
    tag = shoot(opened)["capture"]
    shoot(opened, "again", page=1)
    assert put(opened, TURNED, tag).status_code == 412
    assert opened.get(EDITS).json()["edits"] is None


def test_a_tag_has_to_be_given(opened):
    shoot(opened)
    for headers in ({}, {"If-Match": "*"}, {"If-Match": '"01"'}, {"If-Match": "2"}):
        assert opened.put(EDITS, json={"edits": TURNED}, headers=headers).status_code == 422
    assert opened.get(EDITS).json()["edits"] is None


def test_only_the_tab_in_control_writes(served, opened):
    capture = shoot(opened)["capture"]
    opened.post("/api/control", json={"tab": "a" * 16})
    before = events(opened)
    with served.client("b" * 16) as other:
        assert other.get(EDITS).status_code == 200
        assert put(other, TURNED, capture).json()["error"]["key"] == "read_only"
        refused = other.post("/api/rules", json={"scope": {"captures": "all"}, "edits": TURNED})
        assert refused.json()["error"]["key"] == "read_only"
    assert events(opened) == before


HOSTILE = {
    "an unknown field": {"spines": []},
    "another version": {"version": 99},
    "a number as text": {"overlap_mm": "1"},
    "more overlap than there is": {"overlap_mm": 11},
    "an angle beyond its range": {"parts": {"page": {"rotate_deg": 46}}},
    "an unknown part": {"parts": {"middle": {}}},
    "one point": {"spine": [[1, 1]]},
    "17 points": {"spine": [[1, n] for n in range(17)]},
    "a point far away": {"spine": [[1e9, 1], [1, 2]]},
    "more points than a hand draws": {"parts": {p: {"outline": [[n, n] for n in range(200)], "masks": [
        {"what": "remove", "polygon": [[n, n] for n in range(200)]}] * 4} for p in ("left", "right", "page")}},
    "settings that are none": {"parts": {"page": {"settings": {"dpi": -3}}}},
    "a parts list": {"parts": []},
    "a box that rounds to nothing": {"parts": {"page": {"crop": {"mode": "box", "box": [5, 5, 5.0000001, 9]}}}},
    "a size that rounds to nothing": {"parts": {"page": {"size_mm": [0.001, 9]}}},
    "corrections in space": {"frame": "space"},
}  # fmt: skip


def test_hostile_values_change_nothing(opened):
    capture = shoot(opened)["capture"]
    before = events(opened)
    for name, edits in HOSTILE.items():
        for answer in (
            put(opened, edits, capture),
            opened.post("/api/rules", json={"scope": {"captures": "all"}, "edits": edits}),
        ):
            assert (answer.status_code, answer.json()["error"]["key"]) == (422, "invalid"), name
    assert events(opened) == before
    assert put(opened, TURNED, capture).status_code == 200  # and the loop is at work


@pytest.mark.parametrize(
    ("body", "status"),
    [(b'{"edits": {"overlap_mm": NaN}}', 422), (b'{"edits": ' + b"[" * 30_000, 400), (b'{"edits": {"layout"', 422)],
    ids=["not a number", "30,000 brackets", "cut off"],
)
def test_a_body_that_is_not_json_changes_nothing(opened, body, status):
    capture = shoot(opened)["capture"]
    headers = {"If-Match": f'"{capture}"', "Content-Type": "application/json"}
    assert opened.put(EDITS, content=body, headers=headers).status_code == status
    assert opened.get(EDITS).json()["edits"] is None


def test_a_rule_is_one_step_for_all_its_pages(opened):
    captures = [shoot(opened)["capture"] for _ in range(3)]
    made = opened.post("/api/rules", json={"scope": {"captures": captures[1:]}, "edits": TURNED})
    assert (made.status_code, made.json()["pages"]) == (201, [2, 3])
    shown = opened.get("/api/pages/3/edits").json()
    assert shown["sources"] == [{"source": f"rule {made.json()['rule']}", "edits": TURNED}]
    assert opened.get(EDITS).json()["sources"] == []
    press(opened, "undo")
    wait_for(lambda: opened.get("/api/pages/3/edits").json()["sources"] == [], "the undo")
    assert opened.get("/api/pages/2/edits").json()["effective"] is None
    wait_for(lambda: not any(row["outdated"] for row in rows(opened)), "the earlier restorations")


def test_a_rule_is_planned_without_being_recorded_and_names_the_pages_that_keep_their_own(opened):
    captures = [shoot(opened)["capture"] for _ in range(2)]
    put(opened, {"parts": {"page": {"turn": 3}}}, captures[1], "/api/pages/2/edits")
    rule = {"scope": {"captures": "all"}, "edits": TURNED}
    planned = opened.post("/api/rules/plan", json=rule)
    assert (planned.status_code, planned.json()) == (200, {"pages": [1, 2], "own": {"2": ["page.turn"]}})
    assert opened.get(EDITS).json()["sources"] == []
    made = opened.post("/api/rules", json=rule).json()
    assert made == {"rule": made["rule"], **planned.json()}
    assert opened.post("/api/rules/plan", json={**rule, "scope": {"captures": [10**6]}}).status_code == 422


def test_a_rule_takes_the_place_of_a_pages_own_corrections_and_gives_it_back(opened):
    """One step, and one undo. The other corrections of the page stay, and its tag changes."""
    capture = shoot(opened)["capture"]
    own = {"layout": "whole", "parts": {"page": {"turn": 3}}}
    tag = put(opened, own, capture).json()["tag"]
    rule = {"scope": {"captures": "all", "over": [capture]}, "edits": TURNED}
    assert opened.post("/api/rules/plan", json=rule).json()["own"] == {"1": ["page.turn"]}
    made = opened.post("/api/rules", json=rule).json()
    assert made["own"] == {}
    found = opened.get(EDITS).json()
    assert (found["edits"], found["effective"]["parts"], found["tag"]) == (
        {"layout": "whole"},
        TURNED["parts"],
        made["rule"],
    )
    assert put(opened, own, tag).status_code == 412
    later = {"layout": "whole", "parts": {"page": {"rotate_deg": 1.0}}}
    assert put(opened, later, made["rule"]).json()["effective"]["parts"] == {"page": {"turn": 1, "rotate_deg": 1.0}}
    press(opened, "undo")
    wait_for(lambda: opened.get(EDITS).json()["tag"] == made["rule"], "the undo")
    press(opened, "undo")
    wait_for(lambda: opened.get(EDITS).json()["edits"] == own, "the undo of the rule")


def test_a_rule_names_scans_and_no_places_of_one_scan(opened):
    capture = shoot(opened)["capture"]
    before = events(opened)
    outline = {"parts": {"left": {"outline": [[0, 0], [9, 0], [9, 9]]}}}
    for captures, edits in (
        ([capture + 1], TURNED),
        ([10**6], TURNED),
        ([], TURNED),
        ("all", {}),
        ("all", {"spine": [[1, 1], [1, 2]]}),
        ("all", outline),
    ):
        answer = opened.post("/api/rules", json={"scope": {"captures": captures}, "edits": edits})
        assert answer.status_code == 422
    assert events(opened) == before


def test_the_layout_of_a_page_is_that_of_its_scan(opened):
    capture = shoot(opened)["capture"]
    found = opened.get("/api/pages/1/layout").json()
    expected = json.loads(json.dumps(find_layout(curl_scan()).as_json()))
    assert found == {"page": 1, "capture": capture, **expected}
    assert opened.get("/api/pages/2/layout").json()["error"]["key"] == "no_page"

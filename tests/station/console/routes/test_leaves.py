"""The contact sheet through HTTP: order, labels and leaves that are left out; each change is one step."""

from __future__ import annotations

import pytest

from tests.station.console.conftest import wait_for
from tests.station.console.routes.test_pages import press, shoot


@pytest.fixture
def three(opened):
    """A session of three pages."""
    for _ in range(3):
        shoot(opened)
    return opened


def names(browser):
    return [leaf["name"] for leaf in browser.get("/api/leaves").json()["leaves"]]


def events(browser):
    return browser.get("/api/state").json()["session"]["events"]


def test_leaves_are_moved_in_one_step_that_undo_takes_back(three):
    before = events(three)
    moved = three.post("/api/order", json={"leaves": ["2", "3"], "before": "1"})
    assert (moved.status_code, [leaf["name"] for leaf in moved.json()["leaves"]]) == (200, ["2", "3", "1"])
    assert [leaf["label"] for leaf in moved.json()["leaves"]] == ["1", "2", "3"]
    assert events(three) == before + 1
    three.post("/api/order", json={"leaves": ["1"]})  # it is the last already
    assert events(three) == before + 1
    assert [row["page"] for row in three.get("/api/pages").json()["pages"]] == [2, 3, 1]
    press(three, "undo")
    wait_for(lambda: names(three) == ["1", "2", "3"], "the undo")


def test_a_leaf_is_left_out_put_back_and_labelled(three):
    left = three.put("/api/leaves", json={"leaf": "2", "left_out": True}).json()["leaves"]
    assert [(leaf["position"], leaf["left_out"]) for leaf in left] == [(1, False), (0, True), (2, False)]
    before = events(three)
    back = three.put("/api/leaves", json={"leaf": "2", "left_out": False, "label": " iv "}).json()["leaves"]
    assert [(leaf["position"], leaf["label"]) for leaf in back] == [(1, "1"), (2, "iv"), (3, "3")]
    assert events(three) == before + 2
    three.put("/api/leaves", json={"leaf": "2", "left_out": False, "label": "iv"})
    assert events(three) == before + 2


def test_what_cannot_be_changes_nothing_and_the_loop_goes_on(three):
    before = events(three)
    for method, path, body in (
        ("POST", "/api/order", {"leaves": ["1"], "before": "1"}),
        ("POST", "/api/order", {"leaves": ["1", "9"], "before": "2"}),
        ("POST", "/api/order", {"leaves": ["1/left"], "before": "2"}),
        ("POST", "/api/order", {"leaves": []}),
        ("POST", "/api/order", {"leaves": ["../1"]}),
        ("PUT", "/api/leaves", {"leaf": "9", "label": "x"}),
        ("PUT", "/api/leaves", {"leaf": "1", "label": "a\u0000b"}),
        ("PUT", "/api/leaves", {"leaf": "1", "left_out": "yes"}),
    ):
        assert three.request(method, path, json=body).status_code in (404, 409, 422), body
    assert events(three) == before
    assert three.post("/api/order", json={"leaves": ["1"]}).status_code == 200

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


def move(browser, leaves, before=None, tag=None):
    """Move leaves in the order of a tag, the present one by default."""
    tag = browser.get("/api/leaves").json()["tag"] if tag is None else tag
    return browser.post("/api/order", json={"leaves": leaves, "before": before}, headers={"If-Match": f'"{tag}"'})


def change(browser, name, tag=None, **values):
    """Change a leaf of a tag, the present one by default."""
    leaves = {leaf["name"]: leaf for leaf in browser.get("/api/leaves").json()["leaves"]}
    tag = leaves[name]["tag"] if tag is None else tag
    return browser.put("/api/leaves", json={"leaf": name, **values}, headers={"If-Match": f'"{tag}"'})


def test_leaves_are_moved_in_one_step_that_undo_takes_back(three):
    before = events(three)
    moved = move(three, ["2", "3"], "1")
    assert (moved.status_code, [leaf["name"] for leaf in moved.json()["leaves"]]) == (200, ["2", "3", "1"])
    assert [leaf["label"] for leaf in moved.json()["leaves"]] == ["1", "2", "3"]
    assert moved.headers["etag"] == three.get("/api/leaves").headers["etag"] == f'"{before + 1}"'
    assert events(three) == before + 1
    move(three, ["1"])  # it is the last already
    assert events(three) == before + 1
    assert [row["page"] for row in three.get("/api/pages").json()["pages"]] == [2, 3, 1]
    press(three, "undo")
    wait_for(lambda: names(three) == ["1", "2", "3"], "the undo")
    assert three.get("/api/leaves").json()["tag"] == 0


def test_a_leaf_is_left_out_put_back_and_labelled(three):
    left = change(three, "2", left_out=True).json()["leaves"]
    assert [(leaf["position"], leaf["left_out"]) for leaf in left] == [(1, False), (0, True), (2, False)]
    before = events(three)
    back = change(three, "2", left_out=False, label=" iv ").json()["leaves"]
    assert [(leaf["position"], leaf["label"]) for leaf in back] == [(1, "1"), (2, "iv"), (3, "3")]
    assert events(three) == before + 2
    change(three, "2", left_out=False, label="iv")
    assert events(three) == before + 2


def test_the_second_of_two_windows_that_move_leaves_gets_the_order_of_the_first(three):
    first = move(three, ["3"], "1", 0)
    refused = move(three, ["2"], "1", 0)
    assert (refused.status_code, refused.headers["etag"]) == (412, first.headers["etag"])
    fault = refused.json()["error"]
    assert (fault["key"], fault["data"]["current"]) == ("changed", first.json())
    assert names(three) == ["3", "1", "2"]
    assert move(three, ["2"], "1", first.json()["tag"]).status_code == 200
    assert names(three) == ["3", "2", "1"]


def test_the_second_of_two_windows_that_change_a_leaf_gets_the_leaf_of_the_first(three):
    """The tag of a leaf, of its label and of being left out; those of others stay."""
    assert change(three, "1", 0, label="iv").status_code == 200
    shown = three.get("/api/leaves").json()["leaves"][0]
    for values in ({"label": "v"}, {"left_out": True}):
        refused = change(three, "1", 0, **values)
        assert (refused.status_code, refused.headers["etag"]) == (412, f'"{shown["tag"]}"')
        assert refused.json()["error"]["data"]["current"] == shown
    assert three.get("/api/leaves").json()["leaves"][0] == shown
    assert three.get("/api/pages").json()["pages"][0]["parts"][0]["tag"] == shown["tag"]
    assert change(three, "2", 0, left_out=True).status_code == 200
    assert change(three, "1", shown["tag"], label="v").status_code == 200
    press(three, "undo")
    wait_for(lambda: three.get("/api/leaves").json()["leaves"][0] == shown, "the undo")


def arrange(browser, path, tag=None, **body):
    """Change the arrangement of a tag, the present one by default."""
    tag = browser.get("/api/leaves").json()["tag"] if tag is None else tag
    return browser.put(path, json=body, headers={"If-Match": f'"{tag}"'})


FOLIOS = {"style": "folio", "first": 7, "bracket": True}


def test_leaves_are_numbered_from_one_on_in_one_step(three):
    before = events(three)
    found = arrange(three, "/api/labels", leaf="2", run=FOLIOS).json()
    assert [leaf["label"] for leaf in found["leaves"]] == ["1", "[7r]", "[7v]"]
    assert [leaf["run"] and leaf["run"]["style"] for leaf in found["leaves"]] == [None, "folio", None]
    assert events(three) == found["tag"] == before + 1
    arrange(three, "/api/labels", leaf="2", run=FOLIOS)
    assert events(three) == before + 1
    assert arrange(three, "/api/labels", 0, leaf="2", run=None).status_code == 412
    found = arrange(three, "/api/labels", leaf="2", run=None).json()
    assert [leaf["label"] for leaf in found["leaves"]] == ["1", "2", "3"]


def test_missing_leaves_are_named_and_taken_back(three):
    found = arrange(three, "/api/missing", before="3", labels=["3", " 4 "]).json()
    assert [leaf["missing"] for leaf in found["leaves"]] == [[], [], ["3", "4"]]
    assert found["leaves"][2]["label"] == "5"
    assert arrange(three, "/api/missing", 0, before="3", labels=[]).status_code == 412
    found = arrange(three, "/api/missing", before="3", labels=[]).json()
    assert [leaf["missing"] for leaf in found["leaves"]] == [[], [], []]


def test_leaves_that_look_the_same_name_each_other_until_one_is_left_out(opened, served):
    shoot(opened)
    served.restorer.drawn = 1  # the picture of the first page
    shoot(opened)
    assert [leaf["same"] for leaf in opened.get("/api/leaves").json()["leaves"]] == [["2"], ["1"]]
    change(opened, "2", left_out=True)
    assert [leaf["same"] for leaf in opened.get("/api/leaves").json()["leaves"]] == [[], []]


def test_a_review_has_sizes_and_what_differs_and_a_page_is_kept_or_rejected(opened, served):
    shoot(opened)
    served.restorer.drawn = 1  # the picture of the first page
    shoot(opened)
    one, two = opened.get("/api/review").json()["leaves"]
    assert (two["name"], two["level"], two["rank"] > one["rank"]) == ("2", "red", True)
    assert {"width_mm", "height_mm", "sampling_ppi", "event", "layer"} <= two.keys()
    assert [check["same_as"] for check in two["checks"] if check["level"] == "red"] == ["1"]
    press(opened, "keep_both", page=2)
    wait_for(lambda: opened.get("/api/review").json()["leaves"][1]["level"] == "green")
    assert opened.get("/api/pages").json()["pages"][1]["kept"] == ["1"]
    press(opened, "reject", page=1)
    wait_for(lambda: opened.get("/api/pages").json()["pages"][0]["state"] == "again")


def test_what_cannot_be_changes_nothing_and_the_loop_goes_on(three):
    before = events(three)
    for method, path, body in (
        ("POST", "/api/order", {"leaves": ["1"], "before": "1"}),
        ("POST", "/api/order", {"leaves": ["1", "9"], "before": "2"}),
        ("POST", "/api/order", {"leaves": ["1/left"], "before": "2"}),
        ("POST", "/api/order", {"leaves": []}),
        ("POST", "/api/order", {"leaves": ["../1"]}),
        ("PUT", "/api/leaves", {"leaf": "9", "label": "x"}),
        ("PUT", "/api/labels", {"leaf": "9", "run": FOLIOS}),
        ("PUT", "/api/labels", {"leaf": "1", "run": {"style": "runes"}}),
        ("PUT", "/api/labels", {"leaf": "1", "run": {"first": -1}}),
        ("PUT", "/api/missing", {"before": "9", "labels": ["x"]}),
        ("PUT", "/api/missing", {"before": "1", "labels": ["a\u0000b"]}),
        ("PUT", "/api/leaves", {"leaf": "1", "label": "a\u0000b"}),
        ("PUT", "/api/leaves", {"leaf": "1", "left_out": "yes"}),
    ):
        answer = three.request(method, path, json=body, headers={"If-Match": '"0"'})
        assert answer.status_code in (404, 409, 422), body
    for body in ({"leaves": ["2"], "before": "1"}, {"leaf": "1", "label": "x"}):  # a tag has to be given
        method, path = ("POST", "/api/order") if "leaves" in body else ("PUT", "/api/leaves")
        for headers in ({}, {"If-Match": "*"}, {"If-Match": "0"}, {"If-Match": '"-1"'}):
            assert three.request(method, path, json=body, headers=headers).status_code == 422
    assert events(three) == before
    assert move(three, ["1"]).status_code == 200

"""The description of a volume through HTTP: replaced as one step, and never over that of another window."""

from __future__ import annotations

import pytest

from station.console.routes.about import shown_about
from station.session import read_session
from tests.station.console.conftest import wait_for
from tests.station.console.routes.test_pages import press, shoot

MISSAL = {
    "title": "Missale",
    "creators": ["A. B.", "C. D."],
    "language": "la",
    "direction": "rtl",
    "identifiers": [{"scheme": "urn", "value": "urn:nbn:1"}],
    "rights": "https://creativecommons.org/publicdomain/mark/1.0/",
}


def put(browser, about, tag):
    return browser.put("/api/about", json={"about": about}, headers={"If-Match": f'"{tag}"'})


def test_a_volume_is_described_in_one_step_that_undo_takes_back(opened, root):
    shoot(opened)
    assert opened.get("/api/about").json() == {"tag": 0, "about": {}}
    made = put(opened, MISSAL, 0)
    assert (made.status_code, made.json()["about"]) == (200, MISSAL)
    assert made.headers["etag"] == opened.get("/api/about").headers["etag"] == f'"{made.json()["tag"]}"'
    assert shown_about(read_session(root / "missale")) == made.json()
    again = put(opened, MISSAL, made.json()["tag"])
    assert again.json() == made.json()  # nothing is recorded
    press(opened, "undo")
    wait_for(lambda: opened.get("/api/about").json() == {"tag": 0, "about": {}}, "the undo")


def test_what_another_window_described_meanwhile_is_returned(opened):
    first = put(opened, {"title": "A"}, 0).json()
    late = put(opened, {"title": "B"}, 0)
    assert (late.status_code, late.json()["error"]["data"]["current"]) == (412, first)
    assert late.headers["etag"] == f'"{first["tag"]}"'
    assert opened.get("/api/about").json() == first
    assert opened.put("/api/about", json={"about": {}}).status_code == 422


@pytest.mark.parametrize(
    "about",
    [
        {"titel": "A"},
        {"title": 7},
        {"title": "a\u0007b"},
        {"title": "x" * 501},
        {"direction": "up"},
        {"rights": "file:///etc/passwd"},
        {"creators": "A. B."},
        {"identifiers": [{"scheme": "urn"}]},
        [],
        None,
    ],
)
def test_values_that_cannot_be_change_nothing(opened, about):
    assert put(opened, about, 0).status_code == 422
    assert opened.get("/api/about").json() == {"tag": 0, "about": {}}

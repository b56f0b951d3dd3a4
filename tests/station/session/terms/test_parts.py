"""Parts of a restoration: which there are, what was measured, which files are theirs."""

from __future__ import annotations

from station.session.log.events import Event
from station.session.log.history import restoration_of
from station.session.terms.parts import errors_of, measured_parts, parts_of
from station.verdict.packed import PACKED_BYTES, pack
from tests.station.conftest import GOOD

MEASURED = {**GOOD, "fingerprint": pack(bytes(PACKED_BYTES))}
LEAVES = {"parts": {"left": {"measures": MEASURED}, "right": {"error": "dark", "hint": "light"}, "page": {}}}


def test_a_result_of_before_is_one_page():
    assert parts_of({}) == {"page": {}}
    assert parts_of({"measures": {}}) == {"page": {"measures": {}}}
    assert parts_of({"part": "of a lamp"}) == {"page": {"part": "of a lamp"}}


def test_leaves_come_from_left_to_right_without_the_whole():
    assert list(parts_of({"parts": dict(reversed(LEAVES["parts"].items()))})) == ["left", "right"]
    assert measured_parts(LEAVES) == {"left": MEASURED}
    assert list(errors_of(LEAVES)) == [("right", "dark", "light")]


def test_files_of_a_part():
    def run(result, *files):
        return Event(2, 1, "stage", "restore@1", None, "", "", {"result": result}, (), dict.fromkeys(files, ""))

    assert restoration_of(run({}, "page.png")).file("page") == "page.png"
    assert restoration_of(run({"part": "right"}, "page.png")).file("right") == "page.png"
    split = run(LEAVES, "page-left.png", "page-left-coverage.png", "page.png")
    assert restoration_of(split).file("left", "-coverage.png") == "page-left-coverage.png"
    assert (restoration_of(split).file("page"), restoration_of(split).file("right")) == ("page.png", None)

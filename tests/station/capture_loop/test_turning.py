"""The leaf that is to lie before the scanner follows from the session alone."""

from __future__ import annotations

from concurrent.futures import Future

import pytest

from drivers import ScannerError
from station.capture_loop.loop import CaptureLoop
from station.capture_loop.turning import Place, place_of, turn
from station.session import Volume, add_scan, create_session, open_session, undo
from station.session.terms.presets import load_preset


@pytest.fixture
def folder(tmp_path):
    preset = load_preset("book").model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="book", preset="book", preset_values=preset))
    return tmp_path / "book"


def never(_source, _parameters, _folder) -> Future:
    return Future()


def work(writer, keys, scan, turned):
    """Press keys in a loop that restores nothing; the places that were turned to."""
    loop = CaptureLoop(writer, lambda: scan, never, lambda _line: None, turn=turned)
    loop._take_up()
    for key in keys:
        loop.type(key)


def test_each_new_page_is_the_next_opening_and_again_is_another_attempt(folder, tiny_scan):
    places = []
    with open_session(folder) as writer:
        work(writer, "  rr r", tiny_scan, places.append)
    assert places == [(0, 0), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1)]


def test_a_loop_that_was_killed_goes_on_at_the_right_leaf(folder, tiny_scan):
    places = []
    with open_session(folder) as writer:
        work(writer, "  r", tiny_scan, places.append)
    with open_session(folder) as writer:
        work(writer, "r ", tiny_scan, places.append)
    assert places[3:] == [(1, 2), (2, 0)]


def test_an_earlier_page_lies_where_it_lay(folder, tiny_scan):
    with open_session(folder) as writer:
        for page in (None, None, None, 1):
            add_scan(writer, tiny_scan, page=page, facts={"by": "a test"})
        assert place_of(writer.history, 1) == Place(0, 2)
        assert place_of(writer.history, 2) == Place(1, 1)
        assert place_of(writer.history, None) == Place(3, 0)


def test_a_capture_that_was_undone_is_not_an_opening(folder, tiny_scan):
    with open_session(folder) as writer:
        for _ in range(2):
            add_scan(writer, tiny_scan, facts={"by": "a test"})
        undo(writer)
        assert place_of(writer.history, None) == Place(1, 0)


def test_leaves_that_jam_are_reported_and_nothing_is_captured(folder, tiny_scan):
    def jam(_place):
        raise ScannerError("the leaf is torn", "turn it by hand")

    with open_session(folder) as writer:
        work(writer, " ", tiny_scan, jam)
        assert list(writer.history.pages()) == []


def test_only_a_scanner_that_turns_is_turned():
    class Robot:
        def turn_to(self, opening, attempt):
            places.append((opening, attempt))

    places: list[tuple[int, int]] = []
    turn(Robot(), Place(2, 1))
    turn(object(), Place(3, 0))
    assert places == [(2, 1)]

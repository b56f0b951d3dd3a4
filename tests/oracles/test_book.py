"""The table of the simulated volume agrees with its configuration, and with itself."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from drivers.simulated.config import read
from oracles.book import BOOK, TOTALS, side_sizes, spine_mm, words_on
from station.config import BOOK as NAME
from station.config import load_config


@pytest.fixture(scope="module")
def openings():
    return read(load_config(Path(NAME)).scanner).book


def test_the_openings_are_those_of_the_table(openings):
    assert [one.lies for one in openings] == [row.lies for row in BOOK]
    assert [row.number for row in BOOK] == list(range(1, 16))


def test_the_totals_are_those_of_the_table():
    level = {row.number: row.first.split()[0].strip(",") for row in BOOK}
    first, last = (
        Counter(level.values()),
        Counter((level | {row.number: "green" for row in BOOK if row.again}).values()),
    )
    shots, sides = len(BOOK) + sum(bool(row.again) for row in BOOK), sum(len(row.sides) for row in BOOK)
    assert (
        f"{len(BOOK)} openings, {shots} shots: at first {first['green']} green, {first['amber']} amber, {first['red']} "
        f"red; after the two `r` {last['green']} green, {last['amber']} amber; {sides} leaf sides delivered"
    ) == TOTALS


def test_labels_go_to_sides_that_are_delivered(openings):
    assert all(len(one.labels) in (0, len(row.sides)) for one, row in zip(openings, BOOK, strict=True))


def test_the_spine_is_where_the_sheet_has_its_gutter(openings):
    for one in openings:
        sheet, _ = one.build()
        if (spine := spine_mm(one)) is not None:
            assert spine == one.page_mm[0] / 2 + sheet.offset_mm


def test_leaves_have_the_size_and_the_words_of_their_half(openings):
    assert side_sizes(openings[4], ("left", "right")) == {"left": (121.0, 180.0), "right": (139.0, 180.0)}
    assert side_sizes(openings[0], ("page",)) == {"page": (134.0, 186.0)}
    printed = openings[4].build()[1].print_on(openings[4].page_mm)
    sides = {side: {word.text for word in words_on(printed, 121.0, side)} for side in ("left", "right", "page")}
    assert ("2v" in sides["left"], "2v" in sides["right"], "3r" in sides["right"]) == (True, False, True)
    assert sides["page"] == sides["left"] | sides["right"]

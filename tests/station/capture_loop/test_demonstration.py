"""A shift over a simulated volume ends in the table of what each capture gave."""

from __future__ import annotations

import pytest

from oracles.book import BOOK, TOTALS
from station.capture_loop.demonstration import Opening, Shift, outcome, table, totals, work_shift
from station.config import StationConfig
from station.errors import UsageError
from station.session.log.results import QualityCheck, Restored

TWO, ONE, RIGHT = Restored(parts={"left": {}, "right": {}}), Restored(), Restored(part="right")


def checked(level, name, text):
    check = {"name": name, "level": level, "text": text, "value": 1.0, "limits": [1.0, 2.0], "hint": ""}
    return QualityCheck(level=level, checks=[check])


GREEN = checked("green", "blur_px", "focus 0.6 px (amber > 1.2 px)")


@pytest.mark.parametrize(
    ("result", "verdict", "kind", "label", "words"),
    [
        (TWO, GREEN, "spread", "1v–2r", "green, split"),
        (TWO, GREEN, "blank", "", 'green, split, no "same page"'),
        (RIGHT, GREEN, "leaf", "8r", "green, right kept"),
        (ONE, GREEN, "cover", "", "green, cover"),
        (ONE, GREEN, "plate", "4v–5r", "green, whole, 4v–5r"),
        (ONE, GREEN, "foldout", "", "green, whole, not split"),
        (
            TWO,
            checked("red", "similarity", "same page as page 5/left 0.99 (amber > 0.84)"),
            "spread",
            "",
            "red same page as 5",
        ),
        (TWO, checked("red", "blur_px", "focus 2.8 px (amber > 1.2 px)"), "spread", "", "red focus"),
        (TWO, checked("amber", "cropped_fraction", "cut off 7.5% of the outline"), "spread", "", "amber cut off"),
        (ONE, checked("amber", "layout", "is it an opening?"), "spread", "", "amber layout, `2` splits it"),
    ],
)
def test_what_a_capture_gave(result, verdict, kind, label, words):
    assert outcome(result, verdict, kind, label) == words


def test_the_table_has_a_row_for_each_opening_and_its_totals():
    openings = [Opening(row.number, row.lies, row.first, row.again) for row in BOOK]
    sides = sum(len(row.sides) for row in BOOK)
    assert totals(openings, sides) == TOTALS
    lines = table(Shift(openings, [])).splitlines()
    assert len(lines) == len(BOOK) + 2
    assert all(row.lies in line and row.first in line for row, line in zip(BOOK, lines[1:], strict=False))


def test_a_configuration_without_a_volume_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"scanner\.book"):
        work_shift(tmp_path / "book", StationConfig(scanner={"driver": "simulated"}), print)
    assert list(tmp_path.iterdir()) == []

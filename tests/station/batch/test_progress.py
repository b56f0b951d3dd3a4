"""How far a batch is, and when it ends, as it is printed."""

from __future__ import annotations

from datetime import datetime

import pytest

from station.batch.estimate import MIN_PAGES
from station.batch.progress import Done, Pace

NOON = datetime(2026, 3, 4, 12, 0).astimezone()


def pace(sizes) -> Pace:
    return Pace(sizes, lambda: NOON)


def test_the_end_is_named_when_the_scatter_is_known() -> None:
    made = pace([100] * 20)
    lines = [str(made.done(100, 60.0, 1)) for _ in range(20)]
    assert lines[: MIN_PAGES - 1] == [f"{count} of 20" for count in range(1, MIN_PAGES)]
    assert lines[9] == "10 of 20, ends 12:10"
    assert lines[19] == "20 of 20, ends 12:00"


@pytest.mark.parametrize("workers", [1, 4])
def test_pages_that_scatter_have_an_interval(workers) -> None:
    made = pace([100] * 40)
    lines = [str(made.done(100, 60.0 + 30 * (-1) ** count, workers)) for count in range(10)]
    early, late = lines[-1].partition("ends ")[2].split(" to ")
    assert early < late


def test_an_end_on_another_day_names_it() -> None:
    made = pace([100] * 5000)
    for _ in range(MIN_PAGES):
        line = made.done(100, 60.0, 1)
    assert "Sat" in str(line)  # 83 hours after Wednesday noon


def test_the_fraction_that_is_done() -> None:
    done = pace([100] * 12).done(100, 60.0, 1)
    assert (done, done.fraction) == (Done(1, 12, NOON), 1 / 12)

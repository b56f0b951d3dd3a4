"""The share of a whole run is one of its time; what is left follows from the time that it took."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.progress import WHOLE, time_left
from station.run.overall_progress import expected_of_photographs, with_whole

STAGES = {"one": 1.0, "two": 3.0, "three": 4.0}


def reported(calls):
    """The shares of the whole that are reported during calls (stage, done)."""
    heard = []
    progress = with_whole(lambda stage, done: heard.append((stage, done)), STAGES)
    for call in calls:
        progress(*call)
    assert [one for one in heard if one[0] != WHOLE] == list(calls)
    return [done for stage, done in heard if stage == WHOLE]


def test_stages_count_by_their_time():
    calls = [("one", 0.0), ("one", 1.0), ("two", 0.5), ("two", 1.0), ("three", 1.0)]
    assert reported(calls) == pytest.approx([0.0, 1 / 8, 2.5 / 8, 0.5, 1.0])


def test_other_stages_count_nothing():
    assert reported([("other", 0.5), ("one", 1.0)]) == pytest.approx([1 / 8])


@given(st.lists(st.tuples(st.sampled_from(sorted(STAGES)), st.floats(0, 1)), max_size=12))
def test_the_fraction_never_falls(calls):
    shares = reported(calls)
    assert shares == sorted(shares)
    assert all(0 <= share <= 1 for share in shares)


def test_pairs_of_photographs_grow_with_the_square():
    five, ten = expected_of_photographs(5), expected_of_photographs(10)
    assert ten["features"] == pytest.approx(2 * five["features"])
    assert ten["matching"] == pytest.approx(4.5 * five["matching"])
    assert list(five)[:5] == ["features", "matching", "cameras", "surface", "edge"]


@pytest.mark.parametrize(
    ("elapsed", "share", "text"),
    [
        (3.0, 0.05, ""),  # too early to tell
        (10.0, 0.5, "about 10 s left"),
        (17.0, 0.5, "about 20 s left"),
        (100.0, 0.25, "about 5 min left"),
        (90.0, 0.5, "about 90 s left"),
        (30.0, 0.999, ""),
    ],
)
def test_the_time_left_is_as_precise_as_it_is_known(elapsed, share, text):
    assert time_left(elapsed, share) == text

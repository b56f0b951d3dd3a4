"""Word and character precision against alignments counted by hand."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from station.words.ocr_precision import MatchCount, count_matching_characters, count_matching_words

TEXT = st.lists(st.text("abc", min_size=1, max_size=4), max_size=12).map(" ".join)


@pytest.mark.parametrize(
    ("printed", "read", "correct"),
    [
        ("the quick brown fox", "the quick brown fox", 4),
        ("the quick brown fox", "the quick\n\n  brown fox\f", 4),  # where the lines break does not matter
        ("the quick brown fox", "the qu1ck brown fox", 3),
        ("the quick brown fox", "the brown fox", 3),  # a word left out spoils no other
        ("the quick brown fox", "the quick red brown fox", 4),  # one of five is made up
        ("the quick brown fox", "The quick brown fox.", 2),  # case and punctuation count
        ("the quick brown fox", "", 0),
        ("fine ﬁgures", "ﬁne figures", 2),  # a ligature is the letters it joins
    ],
)
def test_words_read_right(printed, read, correct):
    assert count_matching_words(printed, read).correct == correct


def test_characters_read_right():
    reading = count_matching_characters("quick fox", "qu1ck f ox")
    assert (reading.correct, reading.total) == (8, 10)
    assert reading.precision == 0.8


def test_made_up_words_do_not_help():
    printed = "one two three four"
    assert count_matching_words(printed, printed + " one two three four").precision == 0.5
    assert count_matching_words(printed, "one two").precision == 0.5


def test_a_blank_page_read_as_blank_is_read_right():
    assert count_matching_words("", " \n").precision == 1.0
    assert count_matching_words("", "x").precision == 0.0


def test_readings_of_pages_add_up():
    assert MatchCount(1, 2) + MatchCount(10, 20) == MatchCount(11, 22)


@given(TEXT, TEXT)
def test_precision_is_a_fraction_and_the_same_both_ways(a, b):
    for measure in (count_matching_words, count_matching_characters):
        assert 0 <= measure(a, b).correct <= measure(a, b).total
        assert measure(a, b) == measure(b, a)
        assert measure(a, a).precision == 1.0

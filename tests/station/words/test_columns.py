"""Gutters are found between columns of text and nowhere else; that pages are read by them is tested with the bench."""

import cv2
import numpy as np
import pytest

from station.words.columns import MIN_LENGTH, find_gutters, with_rules

X_HEIGHT_PX = 12.0
LINE, WORD, SPACE = 30, 60, 8  # pixels
SIDES_PX = 12.0  # of a gutter: a word's gap at its ends, and the rounding of the copy


def page(*lefts, lines=30, words=6, width=1400, ragged=False):
    """Ink (h, w) of columns of words that begin at some x, and their right edges."""
    ink = np.zeros((lines * LINE + 100, width), np.uint8)
    for left in lefts:
        for line in range(lines):
            count = words - (line % 3 if ragged else 0)
            for word in range(count):
                x, y = left + word * (WORD + SPACE), 50 + line * LINE
                ink[y : y + 12, x : x + WORD] = 1
    return ink, [left + words * (WORD + SPACE) - SPACE for left in lefts]


@pytest.mark.parametrize("ragged", [False, True])
def test_the_gutter_of_two_columns_is_its_middle(ragged):
    ink, rights = page(60, 560, ragged=ragged)
    (gutter,) = find_gutters(ink, X_HEIGHT_PX)
    assert gutter.x == pytest.approx((rights[0] + 560) / 2, abs=SIDES_PX)
    assert gutter.top == pytest.approx(50, abs=SIDES_PX)
    assert gutter.bottom == pytest.approx(50 + 29 * LINE + 12, abs=SIDES_PX)


def test_three_columns_have_two_gutters():
    ink, _ = page(40, 500, 960)
    assert len(find_gutters(ink, X_HEIGHT_PX)) == 2


def test_a_heading_over_both_columns_is_not_crossed():
    ink, _ = page(60, 560)
    ink[50:110] = 0
    ink[50:90, 60:900] = 1
    (gutter,) = find_gutters(ink, X_HEIGHT_PX)
    assert gutter.top >= 90


@pytest.mark.parametrize(
    "ink",
    [
        page(60)[0],
        page(60, ragged=True)[0],
        page(60, words=15)[0],
        np.zeros((400, 300), np.uint8),
        np.ones((400, 300), np.uint8),
    ],
    ids=["one column", "ragged", "a wide column", "blank", "black"],
)
def test_one_column_has_no_gap(ink):
    assert find_gutters(ink, X_HEIGHT_PX) == []


def test_a_gap_of_a_few_lines_is_not_a_column():
    ink, _ = page(60, 560)
    joined = ink.copy()
    rows = slice(50 + round(30 * MIN_LENGTH - 2) * LINE, None)
    joined[rows] = page(60, words=12)[0][rows]
    upper = slice(0, round(30 * MIN_LENGTH) * LINE + 50)
    assert len(find_gutters(ink[upper], X_HEIGHT_PX)) == 1
    assert find_gutters(joined, X_HEIGHT_PX) == []


def test_a_rule_is_drawn_in_the_copy_alone():
    ink, _ = page(60, 560)
    image = np.dstack([255 - 255 * ink] * 3)
    before = image.copy()
    gutters = find_gutters(ink, X_HEIGHT_PX)
    ruled = with_rules(image, gutters, 300.0)
    np.testing.assert_array_equal(image, before)
    changed = np.flatnonzero((ruled != image).any(axis=(0, 2)))
    assert np.abs(changed - gutters[0].x).max() <= 2
    assert cv2.countNonZero(ruled[:, changed[0], 0]) < len(ruled)

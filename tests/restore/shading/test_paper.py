"""Bare paper is told from ink, from coloured print and from places where the sensor is full."""

import numpy as np
import pytest

from restore.shading.paper import paper_candidates

CELLS, DPI = 60, 60.0
PAPER = np.float32([0.7, 0.68, 0.64])
FIELD = np.s_[20:40, 20:40]
INNER = np.s_[22:38, 22:38]


@pytest.mark.parametrize(
    ("print_colour", "is_paper"),
    [(PAPER, True), (0.9 * PAPER, True), (0.3 * PAPER, False), (PAPER * [1.0, 0.7, 0.7], False), ([1, 1, 1], False)],
    ids=["paper", "a little shadow", "ink", "red", "clipped"],
)
def test_a_field_amid_paper(print_colour, is_paper):
    colour = np.tile(PAPER, (CELLS, CELLS, 1))
    colour[FIELD] = print_colour
    found = paper_candidates(colour, np.ones((CELLS, CELLS), bool), DPI)
    assert found[INNER].all() == is_paper
    assert found[INNER].any() == is_paper
    assert found[2:17, 2:-2].all()


def test_nothing_off_the_page_is_paper():
    inside = np.zeros((CELLS, CELLS), bool)
    assert not paper_candidates(np.tile(PAPER, (CELLS, CELLS, 1)), inside, DPI).any()

"""Two facing pages are printed side by side, their words where they came to stand; leather is brown all over."""

from __future__ import annotations

import numpy as np

from drivers.simulated import Facing, Leather

PAGE_MM, LEFT_MM, MARGIN_MM = (120.0, 90.0), 66.0, 10.0


def test_no_word_is_in_the_gutter():
    printed = Facing(left_mm=LEFT_MM, margin_mm=MARGIN_MM, seed=2).print_on(PAGE_MM)
    edges = np.array([word.box for word in printed.words])[:, [0, 2]]
    sides = edges.mean(axis=1) > LEFT_MM
    assert 0 < sides.sum() < len(sides)
    assert edges[~sides].max() < LEFT_MM - MARGIN_MM + 1.0
    assert edges[sides].min() > LEFT_MM + MARGIN_MM - 1.0


def test_left_and_right_are_printed_alone():
    image = Facing("white", "figure", left_mm=LEFT_MM).print_on(PAGE_MM).image
    split = round(image.shape[1] * LEFT_MM / PAGE_MM[0])
    assert np.ptp(image[:, : split - 1]) < 3
    assert np.ptp(image[:, split:]) > 100


def test_leather_is_brown():
    red, green, blue = Leather().print_on(PAGE_MM).image.reshape(-1, 3).mean(axis=0)
    assert red > green > blue

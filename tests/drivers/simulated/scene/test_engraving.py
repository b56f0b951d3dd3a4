"""An engraving has lines all over the page, within its frame, and no area that gives no range."""

from __future__ import annotations

import numpy as np

from drivers.simulated import Engraving
from drivers.simulated.scene.artwork.engraving import NAMES
from drivers.simulated.scene.artwork.printed import MM_PER_PIXEL

PAGE_MM, MARGIN_MM = (150.0, 100.0), 9.0


def ink(seed: int) -> np.ndarray:
    return Engraving(seed=seed, margin_mm=MARGIN_MM).print_on(PAGE_MM).image.max(axis=2) < 150


def test_lines_are_all_over_the_page_and_thin():
    dark = ink(2)
    cells = dark[: dark.shape[0] // 4 * 4, : dark.shape[1] // 4 * 4].reshape(4, dark.shape[0] // 4, 4, -1)
    assert cells.any(axis=(1, 3)).all()
    assert dark.mean() < 0.1
    edge = round((MARGIN_MM - 1.0) / MM_PER_PIXEL)
    assert not (dark[:edge].any() or dark[-edge:].any() or dark[:, :edge].any() or dark[:, -edge:].any())


def test_another_seed_is_another_landscape():
    assert (ink(2) != ink(3)).mean() > 0.02
    assert (ink(2) == ink(2)).all()


def test_names_are_where_they_are_said_to_be():
    printed = Engraving(seed=2).print_on(PAGE_MM)
    assert {word.text for word in printed.words} <= {part for name in NAMES for part in name.split()}
    for word in printed.words:
        left, bottom, right, top = (value / MM_PER_PIXEL for value in word.box)
        height = len(printed.image)
        box = printed.image[round(height - top) : round(height - bottom), round(left) : round(right)]
        assert (box.max(axis=2) < 150).mean() > 0.05, word

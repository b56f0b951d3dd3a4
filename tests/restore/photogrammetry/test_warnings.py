"""What a reconstruction warns of."""

from __future__ import annotations

import pytest

from restore.photogrammetry.model import Model
from restore.photogrammetry.reconstruct import _warnings

GOOD = 0.97  # of the edge
NEAR = 0.05  # mm of the points from the surface


def model(scale: str) -> Model:
    return Model([], [], None, {}, None, {"from": scale})


@pytest.mark.parametrize(
    ("left_out", "scale", "uncovered", "edge", "off_mm", "words"),
    [
        ({}, "card", 0.0, GOOD, NEAR, []),
        ({"IMG_7.jpg": "no features"}, "card", 0.0, GOOD, NEAR, ["IMG_7.jpg is left out: no features"]),
        ({}, "none", 0.0, GOOD, NEAR, ["the scale is not known"]),
        ({}, "card", 0.03, GOOD, NEAR, ["3% of the paper"]),
        ({}, "card", 0.0, 0.61, NEAR, ["only 61% of the page's edge"]),
        ({}, "card", 0.03, 0.61, NEAR, ["only 61%", "3% of the paper"]),
        ({}, "card", 0.0, GOOD, 0.8, ["the surface passes one in ten of the measured points 0.8 mm"]),
    ],
)
def test_each_doubt_has_its_sentence(left_out, scale, uncovered, edge, off_mm, words):
    found = _warnings(left_out, model(scale), uncovered, edge, off_mm)
    assert len(found) == len(words)
    assert all(sentence.startswith(word) for sentence, word in zip(found, words, strict=True))

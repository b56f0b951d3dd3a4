"""What a reconstruction warns of."""

from __future__ import annotations

import pytest

from restore.photogrammetry.model import Model
from restore.photogrammetry.reconstruct import _warnings

GOOD = 0.97  # of the edge


def model(scale: str) -> Model:
    return Model([], [], None, {}, None, {"from": scale})


@pytest.mark.parametrize(
    ("left_out", "scale", "uncovered", "edge", "words"),
    [
        ({}, "card", 0.0, GOOD, []),
        ({"IMG_7.jpg": "no features"}, "card", 0.0, GOOD, ["IMG_7.jpg is left out: no features"]),
        ({}, "none", 0.0, GOOD, ["the scale is not known"]),
        ({}, "card", 0.03, GOOD, ["3% of the paper"]),
        ({}, "card", 0.0, 0.61, ["only 61% of the page's edge"]),
        ({}, "card", 0.03, 0.61, ["only 61%", "3% of the paper"]),
    ],
)
def test_each_doubt_has_its_sentence(left_out, scale, uncovered, edge, words):
    found = _warnings(left_out, model(scale), uncovered, edge)
    assert len(found) == len(words)
    assert all(sentence.startswith(word) for sentence, word in zip(found, words, strict=True))

"""What a reconstruction warns of."""

from __future__ import annotations

import pytest

from restore.photogrammetry.reconstruct import _warnings

GOOD = {
    "views": ["1.jpg", "2.jpg", "3.jpg", "4.jpg", "5.jpg"],
    "left_out": {},
    "scale": {"from": "card"},
    "edge_measured": 0.97,
    "surface_off_mm": 0.05,
    "stretch": 1e-4,
    "uncovered_paper": 0.0,
}


@pytest.mark.parametrize(
    ("found", "words"),
    [
        ({}, []),
        ({"left_out": {"IMG_7.jpg": "no features"}}, ["IMG_7.jpg is left out: no features"]),
        (
            {"left_out": {"7.jpg": "it is zoomed: its focal length is +3%"}},
            ["7.jpg is left out", "photographs were zoomed"],
        ),
        ({"views": ["1.jpg", "2.jpg", "3.jpg", "4.jpg"]}, ["the page is made of 4 photographs only"]),
        ({"scale": {"from": "none"}}, ["the scale is not known"]),
        ({"uncovered_paper": 0.03}, ["3% of the paper"]),
        ({"edge_measured": 0.61}, ["only 61% of the page's edge"]),
        ({"edge_measured": 0.61, "uncovered_paper": 0.03}, ["only 61%", "3% of the paper"]),
        ({"surface_off_mm": 0.8}, ["the surface passes one in ten of the measured points 0.8 mm"]),
        ({"stretch": 0.011}, ["the surface has +1.1% of area that paper cannot have"]),
        ({"stretch": -0.02}, ["the surface has -2.0% of area that paper cannot have"]),
    ],
)
def test_each_doubt_has_its_sentence(found, words):
    sentences = _warnings(GOOD | found)
    assert len(sentences) == len(words)
    assert all(sentence.startswith(word) for sentence, word in zip(sentences, words, strict=True))

"""What a reconstruction reports of its page."""

from __future__ import annotations

import pytest

from restore.findings import Finding
from restore.photogrammetry.reconstruct import _findings

GOOD = {
    "photographs_used": ["1.jpg", "2.jpg", "3.jpg", "4.jpg", "5.jpg"],
    "scale_source": {"from": "card"},
    "edge_measured_fraction": 0.97,
    "surface_residual_mm": 0.05,
    "excess_area_fraction": 1e-4,
    "gutter_width_range_mm": None,
    "paper_outside_fraction": 0.0,
}


@pytest.mark.parametrize(
    ("found", "words"),
    [
        ({}, []),
        (
            {"rejected": {"IMG_7.jpg": Finding.of("not_joined", reason="no features")}},
            ["IMG_7.jpg is not used: no features"],
        ),
        (
            {"rejected": {"7.jpg": Finding.of("zoomed", change=0.03)}},
            ["7.jpg is not used", "some photographs were zoomed"],
        ),
        ({"photographs_used": ["1.jpg", "2.jpg", "3.jpg", "4.jpg"]}, ["the page is made of 4 photographs only"]),
        ({"scale_source": {"from": "none"}}, ["the scale is not known"]),
        ({"paper_outside_fraction": 0.03}, ["3% of the paper"]),
        ({"edge_measured_fraction": 0.61}, ["only 61% of the page's edge"]),
        ({"edge_measured_fraction": 0.61, "paper_outside_fraction": 0.03}, ["only 61%", "3% of the paper"]),
        ({"surface_residual_mm": 0.8}, ["one in ten of the measured points is 0.8 mm"]),
        ({"excess_area_fraction": 0.011}, ["the surface has +1.1% of area that paper cannot have"]),
        ({"gutter_width_range_mm": 0.05}, []),
        ({"gutter_width_range_mm": 4.4}, ["the strip across the spine is 4.4 mm wider in some rows"]),
        ({"excess_area_fraction": -0.02}, ["the surface has -2.0% of area that paper cannot have"]),
    ],
)
def test_each_doubt_has_its_sentence(found, words):
    findings = _findings(GOOD | found, found.get("rejected", {}))
    assert len(findings) == len(words)
    assert all(one.text.startswith(word) for one, word in zip(findings, words, strict=True))

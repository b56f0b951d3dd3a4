"""Where a spine is, and whether it is one, are two answers; what is not clear is asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import BookPrior
from restore.layout.decide import decide
from restore.layout.finding import LayoutFinding
from restore.layout.spine import Spine

BOOK = Spine(np.array([[100.0, 0.0], [100.0, 150.0]]), 0.1, -80.0, 8.0, 5.0, 1.0, 0.1)


@pytest.mark.parametrize(
    ("change", "crossing", "widths", "answer"),
    [
        ({}, 0.0, (100.0, 110.0), ("split", "sure")),
        ({}, None, (100.0, 110.0), ("split", "sure")),
        ({}, 0.3, (100.0, 110.0), ("whole", "sure")),  # a plate
        ({}, 0.01, (100.0, 110.0), ("ask", "sure")),
        ({}, 0.0, (130.0, 12.0), ("left", "sure")),
        ({}, 0.0, (12.0, 130.0), ("right", "sure")),
        ({"turn_deg": -12.0, "other_deg": 1.0}, 0.0, (100.0, 110.0), ("ask", "unsure")),  # flat-lying
        ({"beyond_deg": 0.0}, 0.0, (100.0, 110.0), ("ask", "unsure")),  # a card, or a stiff binding
        ({"beyond_deg": 0.0}, 0.3, (100.0, 110.0), ("whole", "unsure")),
        ({"bands": 0.8}, 0.0, (100.0, 110.0), ("ask", "unsure")),
        ({"lean_deg": -6.0}, 0.0, (100.0, 110.0), ("ask", "unsure")),
        ({"sigma_mm": 1.5}, 0.0, (100.0, 110.0), ("ask", "unsure")),
        ({"turn_deg": -4.0}, 0.0, (100.0, 110.0), ("whole", "no")),
        ({"beyond_deg": -3.0}, 0.0, (100.0, 110.0), ("whole", "no")),  # a wave
        ({"other_deg": 60.0}, 0.0, (100.0, 110.0), ("whole", "no")),  # a folded letter
    ],
)
def test_answers(change, crossing, widths, answer):
    finding = decide(replace(BOOK, **change), crossing, widths, None)
    assert (finding.advice, finding.is_spine) == answer
    assert finding.reasons and finding.reasons[0]


def test_a_strip_is_known_by_the_leaves_of_the_volume():
    assert decide(BOOK, 0.0, (45.0, 150.0), None).advice == "split"
    assert decide(BOOK, 0.0, (45.0, 150.0), BookPrior((150.0, 200.0))).advice == "right"


def test_without_a_valley_no_spine_is_found():
    assert decide(None, None, None, None).as_json()["spine"] is None


def test_a_finding_is_plain_json():
    finding = LayoutFinding("split", "sure", np.array([[1.234, 5.0]]), widths_mm=(1.0, 2.0), reasons=("one",))
    assert finding.as_json()["spine"] == [[1.23, 5.0]]
    assert finding.as_json()["widths_mm"] == [1.0, 2.0]

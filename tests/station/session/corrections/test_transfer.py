"""Corrections of a page that is captured again: carried where both pages register, else dropped and reported."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from drivers.simulated.scene.artwork import Text
from station.session import add_scan, correct, open_session, undo
from station.session.corrections.transfer import carried_edits, register_pages, uncarried
from station.session.derivation.quality import record_verdict
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE
from station.session.terms.rules import edits_of
from station.verdict.same_page import fingerprint

MASK = {"what": "remove", "polygon": [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]]}
EDITS = edits_of(
    {
        "spine": [[3.0, 0.0], [3.0, 7.0]],
        "kind": "spread",
        "parts": {"left": {"turn": 1, "masks": [MASK], "outline": MASK["polygon"]}},
    }
)
GIVEN = edits_of({"kind": "spread", "by": {"operator": "A. B.", "tool": "cli"}})  # corrections without points


def page(seed: int) -> np.ndarray:
    """A printed page of 100 × 80 mm at 100 dpi."""
    image = Text(title_pt=20, sizes_pt=(10.0,), margin_mm=5, seed=seed).print_on((100.0, 80.0)).image
    return cv2.resize(image, (394, 315), interpolation=cv2.INTER_AREA)


def test_a_page_registers_with_itself_turned_and_not_with_a_blank_one():
    image = page(1)
    turn = cv2.getRotationMatrix2D((197.0, 157.0), 2.5, 1.0)
    turn[:, 2] += (7.0, -4.0)
    turned = cv2.warpAffine(image, turn, (394, 315), borderValue=(255, 255, 255), flags=cv2.INTER_AREA)
    found = register_pages(image, turned)
    corners = np.array([[50.0, 50.0, 1.0], [350.0, 280.0, 1.0]])
    assert corners @ found.T == pytest.approx(corners @ turn.T, abs=1.0)  # a quarter of a millimetre
    assert register_pages(image, np.full_like(image, 255)) is None
    assert register_pages(image, cv2.resize(image, None, fx=1.1, fy=1.1)) is None  # true scale does not change


def test_corrections_without_points_are_carried_at_once_and_undo_takes_them_back(volume, tiny_scan):
    with open_session(volume) as writer:
        earlier = add_scan(writer, tiny_scan, facts={})
        correct(writer, 1, GIVEN)
        later = add_scan(writer, tiny_scan, page=1, facts={})
        assert uncarried(writer.history, later) == (earlier, GIVEN)
        event = correct(writer, 1, carried_edits(writer.session, earlier, later, GIVEN))
        assert event.facts["value"] == {"kind": "spread", "by": {"operator": "A. B.", "tool": "carried"}}
        undo(writer)
        assert "edits" not in writer.history.page(1).decisions
        assert uncarried(writer.history, later) is None  # what was undone is not carried again


def test_points_that_do_not_fit_are_dropped_and_the_page_is_amber(volume, tiny_scan):
    """The scans of twenty points have no page, so nothing registers."""
    with open_session(volume) as writer:
        earlier = add_scan(writer, tiny_scan, facts={})
        correct(writer, 1, EDITS)
        later = add_scan(writer, tiny_scan, page=1, facts={})
        event = correct(writer, 1, carried_edits(writer.session, earlier, later, EDITS))
        assert event.facts["value"]["by"] == {"tool": "dropped"}
        assert "spine" not in event.facts["value"]
        result = {"measures": {"fingerprint": fingerprint(page(1))}}
        run = record_run(writer, RESTORE, later, parameters={}, result=result)
        (check,) = record_verdict(writer, run).checks
        assert (check.name, check.level) == ("corrections", "amber")
        correct(writer, 1, edits_of({"layout": "whole"}))
        assert record_verdict(writer, run).checks == []

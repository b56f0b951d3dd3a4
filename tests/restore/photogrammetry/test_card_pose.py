"""The card's place in a model, although the page hides parts of its markers."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.table_cameras import cameras
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.cameras.card import SCALE_CARD
from restore.photogrammetry.card_pose import find_card

SCALE = 0.8  # of the model's millimetres
CENTRES = np.column_stack([SCALE_CARD.centres, np.zeros(len(SCALE_CARD.centres))])
NOISE_PX = 0.03
# Twelve markers over 140 mm in five views: sixty centres, of which a pixel is 0.7 mm.
SCALE_ERROR = 3e-4


def seen(noise=NOISE_PX, *, left_out=()):
    views = dict(enumerate(cameras()))
    model = {number: Similarity(SCALE, np.eye(3), np.zeros(3)).camera(camera) for number, camera in views.items()}
    rng = np.random.default_rng(4)
    pixels = {number: camera.project(CENTRES) for number, camera in views.items()}
    markers = {
        number: {
            m: pixels[number][m] + noise * rng.standard_normal(2) for m in range(12) if (number, m) not in left_out
        }
        for number in views
    }
    return model, markers


def test_the_scale_is_that_of_the_model():
    model, markers = seen()
    pose, error, count = find_card(model, markers, SCALE_CARD)
    assert pose.scale == pytest.approx(SCALE, rel=SCALE_ERROR)
    assert error < 2 * NOISE_PX
    assert count == 12


def test_markers_that_are_half_hidden_do_not_turn_it():
    model, markers = seen()
    for marker in (2, 7, 9):
        markers[3][marker] = markers[3][marker] + [0.6, -0.8]
    markers[4][11] = markers[4][11] + [12.0, 5.0]
    pose, error, _ = find_card(model, markers, SCALE_CARD)
    assert pose.scale == pytest.approx(SCALE, rel=SCALE_ERROR)
    assert error < 4 * NOISE_PX  # that one is 9 mm off, and would be 1.2 mm in the root mean square of all


def test_a_card_that_is_not_flat_is_reported():
    model, markers = seen()
    raised = CENTRES + np.column_stack([np.zeros((12, 2)), (CENTRES[:, 0] / 70.0) ** 2 * 5.0])
    bent = {number: dict(enumerate(camera.project(raised))) for number, camera in enumerate(cameras())}
    assert find_card(model, {view: bent[view] for view in markers}, SCALE_CARD)[1] > 0.5


def test_too_few_markers_are_not_a_card():
    model, markers = seen()
    few = {number: {m: markers[number][m] for m in (0, 1, 2)} for number in markers}
    assert find_card(model, few, SCALE_CARD) is None
    assert find_card(model, {0: markers[0], 1: markers[1]}, SCALE_CARD) is None

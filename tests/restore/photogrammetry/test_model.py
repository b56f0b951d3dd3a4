"""A model gets its frame from the card, and the card's markers hold its cameras."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.table_cameras import cameras
from restore.photogrammetry.cameras.align import Similarity
from restore.photogrammetry.cameras.bundle import Tracks
from restore.photogrammetry.cameras.card import SCALE_CARD
from restore.photogrammetry.model import Model

CENTRES = np.column_stack([SCALE_CARD.centres, np.zeros(len(SCALE_CARD.centres))])
ELSEWHERE = Similarity(0.02, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([3.0, 1.0, 2.0]))
POINTS = np.array([[10.0, 20.0, 5.0], [-30.0, 5.0, 2.0], [20.0, -15.0, 8.0]])


def model(card=SCALE_CARD) -> Model:
    views = cameras()
    markers = {number: dict(enumerate(camera.project(CENTRES))) for number, camera in enumerate(views)}
    moved = [ELSEWHERE.camera(camera) for camera in views]
    return Model(list(range(len(views))), moved, ELSEWHERE.points(POINTS), markers if card else {}, card)


def test_the_frame_is_millimetres_over_the_card():
    found = model()
    found.set_frame(found.points)
    assert found.scale["from"] == "card"
    assert found.scale["residual_mm"] < 1e-6
    np.testing.assert_allclose(found.points[:, 2], POINTS[:, 2], atol=1e-5)
    distances = np.linalg.norm(found.points[1:] - found.points[0], axis=1)
    np.testing.assert_allclose(distances, np.linalg.norm(POINTS[1:] - POINTS[0], axis=1), rtol=1e-6)


def test_the_change_of_frame_is_returned():
    found = model()
    before = found.points
    np.testing.assert_allclose(found.set_frame(before).points(before), found.points, atol=1e-9)


def test_without_a_card_the_scale_is_a_guess():
    found = model(None)
    found.set_frame(found.points)
    assert found.scale == {"from": "none"}


def test_markers_join_the_tracks_where_their_views_agree():
    found = model()
    found.markers[2].update({m: pixel + [40.0, 0.0] for m, pixel in found.markers[2].items()})  # moved in this view
    tracks = Tracks(np.array([0]), np.array([1]), np.array([[5.0, 6.0]]), np.array([0.1]))
    points, joined = found.with_markers(found.points, tracks)
    assert len(points) == len(POINTS) + 12
    assert set(joined.view[1:]) == {0, 1, 3, 4}
    assert joined.point[1:].min() == len(POINTS)
    assert joined.pixels[0] == pytest.approx([5.0, 6.0])

"""The page is told from the table, and from the card, in photographs and over x and y."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from oracles.table_cameras import cameras, mottled, on_plane, picture
from restore.photogrammetry.page import (
    CardInView,
    PageArea,
    area_of_votes,
    find_paper,
    ground_sample,
    on_page,
)
from restore.photogrammetry.surfaces.surface import Surface

HALF_MM = np.array([80.0, 55.0])  # of the page, which lies on the table
CARD_MM = np.array([[-50.0, -95.0], [50.0, -95.0], [50.0, -70.0], [-50.0, -70.0]])
WOOD, PAPER, INK = (150, 110, 70), (225, 224, 220), (60, 60, 60)
RIM_FRACTION = 0.03  # of the page: the rim that counts as covered, and the perspective of the views
CELL_MM = 2.5  # of an edge in votes: three pixels of the small masks


def photograph(camera) -> np.ndarray:
    """(h, w, 3) uint8: a printed page and a card on wood."""

    def kind(origins, ways):
        places = on_plane(origins, ways, 0.0)
        page = (np.abs(places) < HALF_MM).all(axis=1)
        card = ((places > CARD_MM.min(axis=0)) & (places < CARD_MM.max(axis=0))).all(axis=1)
        ink = page & (np.abs(places) < HALF_MM - 12).all(axis=1) & (mottled(places * 3) > 140)
        return np.where(ink, 2, np.where(page | card, 1, 0))

    colours = np.array([WOOD, PAPER, INK], np.uint8)
    return cv2.GaussianBlur(colours[picture(camera, kind).astype(int)], (0, 0), 0.7)


@pytest.fixture(scope="module")
def masks():
    corners = np.column_stack([CARD_MM, np.zeros(4)])
    cards = [CardInView(seen=camera.project(corners)) for camera in cameras()]
    return find_paper([photograph(camera) for camera in cameras()], cards)


def test_points_of_the_page_are_distinguished_from_those_of_table_and_card(masks):
    places = np.array([[0.0, 0.0], [70.0, 45.0], [-75.0, 10.0], [0.0, -62.0], [100.0, 0.0], [0.0, -80.0]])
    points = np.column_stack([places, np.zeros(len(places))])
    assert on_page(masks, cameras(), points).tolist() == [True, True, True, False, False, False]


@pytest.mark.parametrize("share", [0.0, 0.1, 0.3])
def test_paper_that_the_mesh_leaves_out_is_found(masks, share):
    low, high = -HALF_MM, HALF_MM - [share * 2 * HALF_MM[0], 0.0]
    corners = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    vertices = np.column_stack([corners, np.zeros(4)])
    found = masks.uncovered(cameras(), vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    assert found == pytest.approx(share, abs=RIM_FRACTION)


def test_the_area_is_the_page(masks):
    low, high = -HALF_MM - 25, HALF_MM + 25
    area = area_of_votes(masks, cameras(), Surface.level(low, high, 0.0), low, high)
    np.testing.assert_allclose(area.bounds, [-HALF_MM, HALF_MM], atol=CELL_MM)
    assert area.contains(np.array([[0.0, 0.0], [-79.0 + CELL_MM, 0.0]])).all()
    assert not area.contains(np.array([[0.0, -75.0], [500.0, 0.0]])).any()
    assert not area.contains(np.array([[HALF_MM[0] - 5, 0.0]]), 10.0).any()
    beyond = np.array([[HALF_MM[0] + 7, 0.0], [HALF_MM[0] + 13, 0.0], [HALF_MM[0] + 200, 0.0]])
    assert area.contains(beyond, -10.0).tolist() == [True, False, False]


def test_the_other_views_show_where_the_card_may_lie(masks):
    """Right beside the page, where three views show the white card, and two the table."""
    points = np.array([[0.0, -58.0, 0.0]])
    white = replace(masks, masks=masks.masks.copy())
    white.masks[:3] = 1.0
    assert white.votes(cameras(), points)[0] == pytest.approx(0.6)
    unknown = np.zeros(white.masks.shape, bool)
    unknown[:3] = True
    assert replace(white, unknown=unknown).votes(cameras(), points)[0] == 0.0
    none = replace(white, unknown=np.ones_like(unknown))  # no view is certain
    assert none.votes(cameras(), points)[0] == pytest.approx(0.6)
    assert replace(none, shown=np.arange(5) == 4).votes(cameras(), points)[0] == 0.0  # the last shows all of the card


def test_a_card_is_unknown_but_where_its_markers_are_seen():
    camera = cameras()[0]
    whole = camera.project(np.column_stack([CARD_MM, np.zeros(4)]))
    middle = whole.mean(axis=0)
    card = CardInView(middle + 0.5 * (whole - middle), middle + 0.7 * (whole - middle), whole)
    unknown = find_paper([photograph(camera)], [card]).unknown[0]
    ratio = unknown.shape[1] / camera.size[0]
    at = [np.rint(middle + share * (whole[0] - middle)).astype(int) for share in (0.0, 0.4, 0.6, 0.9, 1.5)]
    assert [bool(unknown[tuple((ratio * one[::-1]).astype(int))]) for one in at] == [False, False, True, True, False]
    assert not find_paper([photograph(camera)], [card._replace(whole=None)]).unknown.any()


def test_views_from_behind_have_no_vote(masks):
    point, facing = np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]])
    assert masks.votes(cameras(), point, facing)[1] == 5
    assert masks.votes(cameras(), point, -facing)[1] == 0
    assert masks.votes(cameras(), point, np.array([[1.0, 0.0, 0.0]]))[1] == 1  # one camera stands to the right


def test_views_that_do_not_see_a_point_have_no_vote(masks):
    adjacent = np.array([[0.0, -62.0, 0.0]])  # table between page and card
    only = np.arange(len(cameras()))[:, None] == 1  # the page hides it in the others, which show paper there
    page_before = replace(masks, masks=np.where(only[..., None], masks.masks, 1.0))
    assert page_before.votes(cameras(), adjacent)[0] > 0.5
    share, count = page_before.votes(cameras(), adjacent, seen=only)
    assert (share, count) == (0.0, 1.0)


def test_the_outline_runs_counter_clockwise(masks):
    cells = np.zeros((30, 40), bool)
    cells[5:20, 10:35] = True
    area = PageArea(cells, np.array([-20.0, -10.0]))
    x, y = area.outline.T
    assert 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() == pytest.approx(24 * 14)  # between middles of cells


def test_the_ground_sample_is_depth_over_focal_length():
    camera = cameras(1)[0]
    point = np.zeros((1, 3))
    depth = camera.rotation[2] @ (point[0] - camera.position)
    assert ground_sample([camera], point) == pytest.approx(depth / camera.focal_px)

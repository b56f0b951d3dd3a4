"""The edge of a page is found in space, although the surface it is looked for on is off."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from oracles.table_cameras import cameras, on_plane, picture
from restore.photogrammetry.page import PaperMasks, without_card
from restore.photogrammetry.page_boundary import find_edge, find_rough_edge
from restore.photogrammetry.surfaces.surface import Surface

HALF_MM = np.array([80.0, 55.0])
HEIGHT_MM = 6.0  # of the page over the table
PAPER, TABLE = 210.0, 120.0
ACCURACY_MM = 0.2  # a third of a pixel
BIAS_MM = 0.03  # a twentieth of a pixel: a step is found between the samples across the edge
INK = 20.0
CARD_MM = np.array([[-40.0, -86.0], [40.0, -86.0], [40.0, -58.0], [-40.0, -58.0]])  # 3 mm beside the page
SQUARES_MM = 4.0  # of the markers, from the rim of the card


@pytest.fixture(scope="module")
def greys():
    def light(origins, ways):
        page = (np.abs(on_plane(origins, ways, HEIGHT_MM)) < HALF_MM).all(axis=1)
        places = on_plane(origins, ways, 0.0)
        return np.where(page, PAPER, TABLE + 8 * np.sin(places[:, 1] / 2))

    return np.stack([cv2.GaussianBlur(picture(camera, light), (0, 0), 0.8) for camera in cameras()])


def known(masks, unknown=False):
    """Masks of paper (v, h, w), unknown (v, h, w) where they do not tell."""
    return PaperMasks(masks, masks.shape[:0:-1], np.broadcast_to(unknown, masks.shape), np.zeros(len(masks), bool))


def paper(greys):
    """The masks of the page in pictures (v, h, w) of it."""
    return known((greys > (PAPER + TABLE) / 2).astype(float))


def level(height):
    return Surface.level(-HALF_MM - 30, HALF_MM + 30, height)


def rectangle(half):
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    return np.concatenate(
        [np.linspace(a, b, 40)[:-1] for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    )


@pytest.mark.parametrize(("off_mm", "wider_mm"), [(0.0, 0.0), (2.0, 3.0), (-1.5, -4.0)])
def test_the_edge_is_found_in_space(greys, off_mm, wider_mm):
    edge = find_edge(paper(greys), greys, cameras(), level(HEIGHT_MM + off_mm), rectangle(HALF_MM + wider_mm))
    assert edge.measured.mean() > 0.8
    points = edge.points[edge.measured]
    np.testing.assert_allclose(edge.places, edge.points[:, :2], atol=1e-6)
    from_side = (HALF_MM - np.abs(points[:, :2])).min(axis=1)
    away_from_corners = (HALF_MM - np.abs(points[:, :2])).max(axis=1) > 8
    assert np.sqrt((from_side[away_from_corners] ** 2).mean()) < ACCURACY_MM
    assert np.sqrt(((points[away_from_corners, 2] - HEIGHT_MM) ** 2).mean()) < 3 * ACCURACY_MM


def from_sides(edge) -> np.ndarray:
    """(n,) mm from the sides of the page to points that are measured, those at its corners left out."""
    points = np.abs(edge.points[edge.measured, :2])
    return (HALF_MM - points).min(axis=1)[(HALF_MM - points).max(axis=1) > 8]


def test_a_step_is_found_between_two_samples(greys):
    edge = find_edge(paper(greys), greys, cameras(), level(HEIGHT_MM), rectangle(HALF_MM))
    assert abs(from_sides(edge).mean()) < BIAS_MM


def test_the_edge_of_a_margin_that_is_far_off_is_found_in_masks(greys):
    edge = find_rough_edge(paper(greys), cameras(), level(HEIGHT_MM - 4.0), rectangle(HALF_MM + 10.0))
    assert edge.measured.mean() > 0.8
    assert np.sqrt((from_sides(edge) ** 2).mean()) < 5 * ACCURACY_MM  # searched over 32 mm once


def test_a_crease_next_to_the_edge_is_not_mistaken_for_it(greys):
    def light(origins, ways):
        x, y = on_plane(origins, ways, HEIGHT_MM).T
        page = (np.abs(x) < HALF_MM[0]) & (np.abs(y) < HALF_MM[1])
        return np.select([page & (y < 8 - HALF_MM[1]), page], [0.6 * PAPER, PAPER], TABLE)

    shaded = np.stack([cv2.GaussianBlur(picture(camera, light), (0, 0), 0.8) for camera in cameras()])
    edge = find_edge(paper(greys), shaded, cameras(), level(HEIGHT_MM), rectangle(HALF_MM - [0.0, 6.0]))
    assert np.abs(from_sides(edge)).max() < 3 * ACCURACY_MM


def test_the_edge_is_found_in_smaller_copies(greys):
    twice = [camera.scaled((2 * camera.size[0], 2 * camera.size[1])) for camera in cameras()]
    given = level(HEIGHT_MM), rectangle(HALF_MM)
    of_copies, of_full = (find_edge(paper(greys), greys, views, *given) for views in (twice, cameras()))
    np.testing.assert_allclose(of_copies.points, of_full.points, atol=1e-6)


def test_no_step_no_edge(greys):
    blank = np.full_like(greys, 150.0)
    edge = find_edge(known(np.ones_like(blank, float)), blank, cameras(), level(HEIGHT_MM), rectangle(HALF_MM))
    assert not edge.measured.any()


def test_the_markers_of_a_card_next_to_the_page_are_not_its_edge():
    low, high = CARD_MM.min(axis=0), CARD_MM.max(axis=0)

    def kind(origins, ways):
        page = (np.abs(on_plane(origins, ways, HEIGHT_MM)) < HALF_MM).all(axis=1)
        places = on_plane(origins, ways, 0.0)
        card, ink = (((places > low + rim) & (places < high - rim)).all(axis=1) for rim in (0.0, SQUARES_MM))
        return np.select([page, ink, card], [3, 2, 1], 0)

    kinds = [picture(camera, kind).astype(int) for camera in cameras()]
    shown = [cv2.GaussianBlur(np.array([TABLE, PAPER, INK, PAPER], np.float32)[one], (0, 0), 0.8) for one in kinds]
    corners = [camera.project(np.column_stack([CARD_MM, np.zeros(4)])) for camera in cameras()]
    masks = known(np.stack([(one == 3) * 1.0 for one in kinds]))
    cardless = [without_card(*seen) for seen in zip(shown, masks.masks, corners, strict=True)]
    far = {}
    for name, pictures in (("with", shown), ("without", cardless)):
        edge = find_edge(masks, np.stack(pictures), cameras(), level(HEIGHT_MM), rectangle(HALF_MM + 1.0))
        adjacent = edge.measured & (edge.places[:, 1] < -HALF_MM[1] + 8) & (np.abs(edge.places[:, 0]) < 40)
        assert adjacent.sum() > 20
        far[name] = np.abs(edge.points[adjacent, 1] + HALF_MM[1]).max()
    assert far["without"] < 3 * ACCURACY_MM
    assert far["with"] > 3 * ACCURACY_MM  # else the card would not matter here


def shown(page) -> np.ndarray:
    """Pictures of a page that lies where page(x, y) is True."""

    def light(origins, ways):
        return np.where(page(*on_plane(origins, ways, HEIGHT_MM).T), PAPER, TABLE)

    return np.stack([cv2.GaussianBlur(picture(camera, light), (0, 0), 0.8) for camera in cameras()])


def rectangular(x, y):
    return (np.abs(x) < HALF_MM[0]) & (np.abs(y) < HALF_MM[1])


def rounded(x, y):
    beyond = np.maximum(np.abs(np.stack([x, y], axis=-1)) - (HALF_MM - RADIUS_MM), 0.0)
    return np.linalg.norm(beyond, axis=-1) < RADIUS_MM


def next_to_a_white_thing(x, y):
    """A rectangle whose corner, and a stretch of a side, lie before something as white as itself."""
    return rectangular(x, y) | (np.hypot(x - HALF_MM[0], y - HALF_MM[1]) < 5.0) | (np.hypot(x, y - HALF_MM[1]) < 6.0)


def test_the_paper_of_a_card_that_the_page_hides_in_part_is_not_its_edge():
    """Of a card that reaches below the page, as seen from most sides, the white paper goes on from that of the page."""
    low, high = np.array([-40.0, -63.0]), np.array([40.0, -40.0])

    def kind(origins, ways):
        page = (np.abs(on_plane(origins, ways, HEIGHT_MM)) < HALF_MM).all(axis=1)
        places = on_plane(origins, ways, 0.0)
        return np.select([page, ((places > low) & (places < high)).all(axis=1)], [2, 1], 0)

    kinds = [picture(camera, kind).astype(int) for camera in cameras()]
    greys = np.stack([cv2.GaussianBlur(np.array([TABLE, PAPER, PAPER])[one], (0, 0), 0.8) for one in kinds])
    corners = np.array([[low[0], low[1], 0], [high[0], low[1], 0], [high[0], high[1], 0], [low[0], high[1], 0]])
    cards = np.stack([filled(camera.project(corners), greys.shape[1:]) for camera in cameras()])
    white = (greys > (PAPER + TABLE) / 2).astype(float)
    most = []
    for unknown in (False, cards):
        edge = find_edge(known(white, unknown), greys, cameras(), level(HEIGHT_MM), rectangle(HALF_MM + 1.0))
        most.append(np.abs(from_sides(edge)).max())
        assert edge.measured.mean() > 0.7
    assert most[1] < 3 * ACCURACY_MM < most[0] / 3


def test_a_long_stretch_that_no_view_shows_is_straight_where_it_nearly_is(greys):
    """Half of the lower side, where the card lies in all views; masks make a dent there, or cut a corner off."""
    low, high = np.array([-40.0, -63.0]), np.array([20.0, -40.0])
    corners = np.array([[low[0], low[1], 6], [high[0], low[1], 6], [high[0], high[1], 6], [low[0], high[1], 6]])
    cards = np.stack([filled(camera.project(corners), greys.shape[1:]) for camera in cameras()])
    masks = known(paper(greys).masks, cards)
    for dent_mm, straight in ((3.0, True), (9.0, False)):
        outline = rectangle(HALF_MM)
        outline[:, 1] += dent_mm * ((outline[:, 1] < 0) & (np.abs(outline[:, 0] + 10.0) < 20.0))
        edge = find_edge(masks, greys, cameras(), level(HEIGHT_MM), outline)
        there = (np.abs(edge.places[:, 0] + 10.0) < 15.0) & (edge.places[:, 1] < 0)
        assert not edge.measured[there].any()
        off = np.abs(edge.places[there, 1] + HALF_MM[1]).max()
        assert (off < 3 * ACCURACY_MM) == straight
        np.testing.assert_allclose(edge.points[there, 2], HEIGHT_MM, atol=3 * ACCURACY_MM)


def filled(corners, shape):
    """(h, w) True within corners (k, 2) pixels and just beyond."""
    mask = cv2.fillPoly(np.zeros(shape, np.uint8), [np.rint(corners).astype(np.int32)], 1)
    return cv2.dilate(mask, np.ones((5, 5), np.uint8)) > 0


RADIUS_MM = 8.0
TOOTH_MM, PITCH_MM = 1.8, 24.0  # above and below the line


def zigzag(x):
    """(n,) mm: how far a long side of a page of many creases goes out."""
    return TOOTH_MM * (4 * np.abs((x / PITCH_MM) % 1 - 0.5) - 1)


def test_a_zigzag_is_followed():
    greys = shown(lambda x, y: (np.abs(x) < HALF_MM[0]) & (np.abs(y) < HALF_MM[1] + zigzag(x)))
    edge = find_edge(paper(greys), greys, cameras(), level(HEIGHT_MM), rectangle(HALF_MM))
    x, y = edge.points[:, :2].T
    long_side = (np.abs(x) < HALF_MM[0] - 8) & (np.abs(y) > HALF_MM[1] - 8)
    assert edge.measured[long_side].mean() > 0.9
    off = (np.abs(y) - HALF_MM[1] - zigzag(x))[long_side]
    assert np.sqrt((off**2).mean()) < 2 * ACCURACY_MM  # its tips are blunt


@pytest.mark.parametrize("picture_of", [rectangular, next_to_a_white_thing])
def test_sides_meet_in_corners_and_are_straight_between_what_is_measured(picture_of):
    masks, start = paper(shown(rectangular)), rectangle(HALF_MM + 2.0)
    edge = find_edge(masks, shown(picture_of), cameras(), level(HEIGHT_MM - 1.0), start)
    corners = np.column_stack([rectangle(HALF_MM)[::39], np.full(4, HEIGHT_MM)])
    found = np.linalg.norm(edge.points - corners[:, None], axis=2)
    assert found.min(axis=1).max() < 3 * ACCURACY_MM  # of lines along 12 mm of the sides, out of the page included
    assert not edge.measured[found.argmin(axis=1)].any()
    assert np.abs(HALF_MM - np.abs(edge.points[:, :2])).min(axis=1).max() < 3 * ACCURACY_MM


def test_round_corners_stay_round():
    edge = find_edge(paper(greys := shown(rounded)), greys, cameras(), level(HEIGHT_MM), rectangle(HALF_MM))
    beyond = np.maximum(np.abs(edge.points[:, :2]) - (HALF_MM - RADIUS_MM), 0.0)
    assert np.linalg.norm(beyond, axis=1).max() < RADIUS_MM + 0.1 * RADIUS_MM  # a corner is 3.3 mm farther out

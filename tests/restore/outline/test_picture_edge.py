"""Sides in a picture whose pixels hold the exact share of the paper."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from restore.outline.crossings import Crossings
from restore.outline.picture_edge import edge_in_picture

PAPER, TABLE = 220.0, 40.0
EXACT = 0.02  # samples: codes are whole numbers, and a pixel's error is shared by the eight about the edge
COLS = np.arange(20, 180)
ROW = 100  # of the last samples on the page
OUTWARDS = np.array([0.0, 1.0])


def picture(shape, edge, paper=PAPER, table=TABLE, blur=0.6):
    """A page that ends an edge rows down the picture: pixels about whole rows hold its share, blurred."""
    share = np.clip(edge + 0.5 - np.arange(shape[0], dtype=float), 0.0, 1.0)[:, None]
    light = cv2.GaussianBlur(np.tile(table + (paper - table) * share, (1, shape[1])), (0, 0), blur)
    return np.repeat(np.rint(light).astype(np.uint8)[..., None], 3, axis=2)


@pytest.fixture
def plane(camera):
    return camera.sheet(camera.facets(camera.plane()), np.ones(camera.indices[0].shape, bool))


def found(plane, texture, spread=1.0):
    """Where the side is seen, in samples from the last row on the page, and what that may be off by.

    Samples are a spread of pixels apart.
    """
    inner = np.stack([np.full(len(COLS), ROW), COLS], axis=1).astype(float)
    samples = np.stack([inner, inner + [1.0, 0.0]], axis=1)[..., ::-1] - [0.0, ROW]
    jacobians = np.tile(np.eye(2)[::-1], (len(COLS), 1, 1))  # a sample a millimetre; y points down the rows
    crossings = Crossings(inner + [0.5, 0.0], samples, jacobians)
    rows, cols = np.indices(texture.shape[:2]).astype(float)
    scan = replace(plane.scan, texture=texture, texture_xy=spread * np.stack([cols, rows], axis=2))
    return edge_in_picture(replace(plane, scan=scan, pixels=scan.texture_xy), crossings, OUTWARDS)


@pytest.mark.parametrize("part", np.linspace(0.0, 1.0, 6))
@pytest.mark.parametrize("blur", [0.2, 0.7])
@pytest.mark.parametrize("table", [TABLE, 120.0, 250.0])
def test_a_side_along_the_rows_is_seen_between_them(plane, part, blur, table):
    edge = found(plane, picture(plane.inside.shape, ROW + part, table=table, blur=blur))
    assert edge.offset == pytest.approx(part, abs=EXACT * (PAPER - TABLE) / abs(PAPER - table))
    assert 0.1 <= edge.sigma < 0.15


def test_nothing_is_seen_without_a_step(plane):
    assert found(plane, picture(plane.inside.shape, ROW + 0.3, table=PAPER - 5.0)) is None


def test_nothing_is_seen_next_to_print(plane):
    texture = picture(plane.inside.shape, ROW + 0.3)
    texture[ROW - 3 : ROW - 1] = 30
    assert found(plane, texture) is None


def test_nothing_is_seen_past_a_shadow_between_paper_and_table(plane):
    texture = picture(plane.inside.shape, ROW + 0.3, table=150.0)
    texture[ROW + 1] = 60
    assert found(plane, texture) is None


def test_a_step_farther_off_is_another(plane):
    assert found(plane, picture(plane.inside.shape, ROW + 2.2)) is None


def test_nothing_is_seen_where_all_have_one_texture_position(plane):
    assert found(plane, picture(plane.inside.shape, ROW + 0.3), spread=0.0) is None


def test_without_a_crossing_nothing_is_seen(plane):
    none = Crossings(np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, 2)))
    texture = picture(plane.inside.shape, ROW + 0.3)
    scan = replace(plane.scan, texture=texture)
    assert edge_in_picture(replace(plane, scan=scan, cut_out=True), none, OUTWARDS) is None


def test_a_scan_without_colour_shows_nothing(plane):
    crossings = Crossings(np.zeros((1, 2)), np.zeros((1, 2, 2)), np.eye(2)[None])
    assert edge_in_picture(replace(plane, scan=replace(plane.scan, texture=None)), crossings, OUTWARDS) is None

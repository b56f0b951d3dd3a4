"""Print over a spine is known from the shadow of a gutter."""

from __future__ import annotations

import numpy as np
import pytest

from restore.layout.crossing import print_over_spine
from restore.page import FlatMesh

PX_MM = 0.2
WIDTH, HEIGHT = 500, 600  # pixels: 100 × 120 mm
SPINE = np.array([[50.0, 0.0], [50.0, 120.0]])


def page(texture):
    corners = np.array([[0.0, 0.0], [WIDTH, 0.0], [WIDTH, HEIGHT], [0.0, HEIGHT]])
    flat = corners * PX_MM * [1.0, -1.0]
    faces = np.array([[0, 2, 1], [0, 3, 2]])
    vertices = np.column_stack([flat, np.zeros(4)])
    return FlatMesh(vertices, faces, corners, texture, flat=flat)


def paper(seed=0):
    """White paper whose light falls off into the gutter, with the noise of a camera."""
    x = (np.arange(WIDTH) + 0.5) * PX_MM - 50.0
    light = 200.0 * (1.0 - 0.8 * np.exp(-np.abs(x) / 6.0))
    noise = np.random.default_rng(seed).normal(0.0, 1.0, (HEIGHT, WIDTH))
    return np.repeat((light + noise)[..., None], 3, axis=2)


def found(picture):
    return print_over_spine(page(np.clip(picture, 0, 255).astype(np.uint8)), SPINE)


def test_a_shadow_is_not_print():
    assert found(paper()) == 0.0


@pytest.mark.parametrize("cols", [slice(0, 240), slice(260, 500), slice(0, 248)])
def test_print_on_one_page_does_not_run_over(cols):
    picture = paper()
    for row in range(40, 560, 20):
        picture[row : row + 8, cols] *= 0.3
    assert found(picture) == 0.0


def test_lines_across_run_over():
    picture = paper()
    for row in range(40, 560, 20):
        picture[row : row + 8] *= 0.3
    assert found(picture) > 0.3


def test_a_smooth_coloured_plate_runs_over():
    picture = paper()
    picture[150:450] *= [0.5, 0.8, 1.0]
    assert found(picture) == pytest.approx(300 / HEIGHT, abs=0.1)


def test_one_line_of_a_title_is_enough_to_ask():
    picture = paper()
    picture[100:118:4] *= 0.4
    assert 0.002 < found(picture) < 0.2


def test_a_page_without_picture_says_nothing():
    assert print_over_spine(page(None), SPINE) is None

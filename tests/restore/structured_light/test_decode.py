"""Codes and edges: exact where nothing disturbs them, none where two places mix."""

from __future__ import annotations

import cv2
import numpy as np

from restore.structured_light import Projector
from restore.structured_light.decode import decode_axis, projected_light

PROJECTOR = Projector(64, 32)
MAGNIFICATION = 4.3  # pixels of the camera to one of the projector
EDGE_PX = 0.02  # linear interpolation of a blurred step, between the pixels on both sides of it


def seen(pattern, shift=0.0, blur=0.8):
    """(60, 240) float32: a pattern as a camera sees it from straight ahead, magnified, shifted and blurred."""
    x, y = np.meshgrid((np.arange(240) - shift) / MAGNIFICATION - 0.5, np.arange(60) / MAGNIFICATION - 0.5)
    where = np.stack([x, y], axis=-1).astype(np.float32)
    large = cv2.remap(pattern.astype(np.float32), where, None, cv2.INTER_NEAREST)
    return cv2.GaussianBlur(large, (0, 0), blur)


def pairs_of(shift=0.0):
    patterns = [seen(pattern, shift) for pattern in PROJECTOR.patterns()]
    return list(zip(patterns[:-2:2], patterns[1:-2:2], strict=True))[: PROJECTOR.bits[0]]


def test_edges_are_found_to_a_fraction_of_a_pixel():
    light = np.full((60, 240), 255, np.float32)
    axis = decode_axis(pairs_of(), light, PROJECTOR.width)
    row = axis.across[30]
    at = np.flatnonzero(np.isfinite(row))
    edge = at + row[at]
    number = np.minimum(axis.code[30, at], axis.code[30, at + 1]) + 1
    # nearest-neighbour drawing puts an edge half-way between the first pixel beyond it and the one before
    drawn = np.ceil(number * MAGNIFICATION) - 0.5
    inside = (at > 4) & (at < 230)
    assert inside.sum() > 40
    np.testing.assert_allclose(edge[inside], drawn[inside], atol=EDGE_PX)


def test_a_code_beyond_the_projector_is_not_decoded():
    light = np.full((60, 240), 255, np.float32)
    axis = decode_axis(pairs_of(), light, 20)
    assert axis.code.max() == 19
    assert (axis.code[30, 120:] == -1).all()
    assert np.isnan(axis.across[30, 120:]).all()


def test_a_mixture_of_two_places_has_no_code():
    light = np.full((60, 240), 255, np.float32)
    mixed = [((a + b) / 2, (c + d) / 2) for (a, c), (b, d) in zip(pairs_of(), pairs_of(shift=77.0), strict=True)]
    alone, both = (decode_axis(pairs, light, PROJECTOR.width).code[30, 90:220] >= 0 for pairs in (pairs_of(), mixed))
    assert alone.mean() > 0.9
    assert both.mean() < 0.1


def test_unlit_pixels_and_the_rim_of_a_shadow_have_no_light():
    rng = np.random.default_rng(2)
    white = np.full((80, 80), 120.0)
    white[:40, :40] = 30.0
    white[40:, :40] = 55.0
    white = cv2.GaussianBlur(white, (0, 0), 0.7)
    black = np.full((80, 80), 30.0)
    noisy = [
        np.clip(np.rint(level + rng.normal(0, 2, level.shape)), 0, 255).astype(np.uint8) for level in (white, black)
    ]
    light = projected_light(*noisy)
    assert (light.level[:38, :40] == 0).mean() > 0.999
    assert (light.level[:, 40:42] == 0).all()
    np.testing.assert_allclose(np.median(light.level[:, 50:]), 90, atol=1)
    assert light.lit[44:, 40:42].mean() > 0.9  # the brighter side of a step between lit surfaces
    assert light.lit[:36, :40].mean() < 0.01  # a shadow and its rim


def test_neighbouring_codes_only_make_an_edge():
    light = np.full((10, 240), 255, np.float32)
    jump = [(np.roll(a[:10], 60, axis=1), np.roll(b[:10], 60, axis=1)) for a, b in pairs_of()]
    axis = decode_axis(jump, light, PROJECTOR.width)
    assert np.isnan(axis.across[5, 59])  # from the last code to the first

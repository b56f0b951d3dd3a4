"""A height field through points, against exact surfaces."""

from __future__ import annotations

import numpy as np
import pytest

from restore.photogrammetry.surface import choose_stiffness, fit_surface

LOW, HIGH = np.array([-100.0, -70.0]), np.array([100.0, 70.0])
RNG = np.random.default_rng(1)
PLACES = RNG.uniform(LOW, HIGH, (6000, 2))
WITHIN = RNG.uniform(LOW + 6, HIGH - 6, (500, 2))


def wave(places):
    """A wave of 90 mm and 35°, as steep as a page that keeps upright."""
    return 10.0 * np.sin(2 * np.pi * (places @ [0.9, 0.43]) / 90.0)


def fitted(heights, stiffness, noise=0.0):
    points = np.column_stack([PLACES, heights(PLACES) + noise * RNG.standard_normal(len(PLACES))])
    return fit_surface(points, LOW, HIGH, stiffness=stiffness)


def test_a_plane_is_exact_whatever_the_stiffness():
    def plane(places):
        return 3.0 + 0.2 * places[:, 0] - 0.1 * places[:, 1]

    surface = fitted(plane, 1e4)
    np.testing.assert_allclose(surface.height(WITHIN), plane(WITHIN), atol=1e-6)
    outside = np.array([[-115.0, 0.0], [0.0, 85.0]])
    np.testing.assert_allclose(surface.height(outside), plane(outside), atol=1e-4)


def test_a_wave_is_followed_to_micrometres():
    error = fitted(wave, 1e-3).height(WITHIN) - wave(WITHIN)
    assert np.sqrt((error**2).mean()) < 0.004


def test_noise_is_averaged():
    error = fitted(wave, 0.1, noise=0.05).height(WITHIN) - wave(WITHIN)
    assert np.sqrt((error**2).mean()) < 0.05 / 2


def test_points_far_off_have_no_weight():
    points = np.column_stack([PLACES, wave(PLACES)])
    points[::20, 2] += 5.0
    error = fit_surface(points, LOW, HIGH, stiffness=0.1).height(WITHIN) - wave(WITHIN)
    assert np.sqrt((error**2).mean()) < 0.02


def test_a_flat_page_gets_a_stiffer_surface_than_a_wave():
    noise = 0.03 * RNG.standard_normal(len(PLACES))
    bent = choose_stiffness(np.column_stack([PLACES, wave(PLACES) + noise]), LOW, HIGH)
    flat = choose_stiffness(np.column_stack([PLACES, noise]), LOW, HIGH)
    assert flat > 10 * bent


def test_derivatives_are_those_of_the_heights():
    surface, step = fitted(wave, 1e-2), 1e-3
    along, up = np.array([step, 0.0]), np.array([0.0, step])
    zx, zy, zxx, zxy, zyy = surface.derivatives(WITHIN).T

    def slopes(places):
        return surface.derivatives(places)[:, :2]

    assert zx == pytest.approx((surface.height(WITHIN + along) - surface.height(WITHIN - along)) / 2 / step, abs=1e-6)
    assert zy == pytest.approx((surface.height(WITHIN + up) - surface.height(WITHIN - up)) / 2 / step, abs=1e-6)
    across = (slopes(WITHIN + along) - slopes(WITHIN - along)) / 2 / step
    assert np.column_stack([zxx, zxy]) == pytest.approx(across, abs=1e-4)
    assert zyy == pytest.approx(((slopes(WITHIN + up) - slopes(WITHIN - up)) / 2 / step)[:, 1], abs=1e-4)


def test_frames_osculate_the_surface():
    surface = fitted(wave, 1e-2)
    points, tangents, normals, bends = surface.frames(WITHIN)
    np.testing.assert_allclose(np.einsum("nki,ni->nk", tangents, normals), 0.0, atol=1e-12)
    a, b = 1.5, -1.0
    rise = 0.5 * (bends @ [a * a, 2 * a * b, b * b])
    near = points + a * tangents[:, 0] + b * tangents[:, 1] + rise[:, None] * normals
    assert np.abs(surface.height(near[:, :2]) - near[:, 2]).max() < 0.005  # of third order
    assert np.abs(rise).max() > 0.015

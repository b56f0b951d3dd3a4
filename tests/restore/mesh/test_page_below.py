"""A strip of the page below an open book's upper page is cut off, and a part of the page is not."""

from __future__ import annotations

import numpy as np
import pytest

from restore import Settings, restore
from restore.mesh.ordered_grid import grid_faces
from restore.mesh.page_below import without_page_below
from restore.mesh.validate import validated
from restore.scan import SurfaceMesh

WIDTH, HEIGHT, PITCH = 150.0, 100.0, 2.0


def leaf(profile) -> SurfaceMesh:
    """A mesh with a height profile(x) mm over x, whose columns lie PITCH apart along it."""
    along, across = np.meshgrid(np.arange(0.0, WIDTH + 0.1, PITCH), np.arange(0.0, HEIGHT + 0.1, PITCH))
    vertices = np.stack([along, HEIGHT - across, profile(along)], axis=-1).reshape(-1, 3)
    return SurfaceMesh(vertices, grid_faces(np.ones(along.shape, bool)))


def curled(x):
    return 8.0 * np.exp(-x / 30.0)


@pytest.mark.parametrize("step", [1.5, 3.0, 6.0])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_strip_behind_a_step_is_cut_off(rng, step, noise):
    mesh = leaf(lambda x: curled(x) - step * (x > 142.0))
    mesh.vertices[:, 0] -= 1.9 * (mesh.vertices[:, 0] > 142.0)  # the step is a wall of less than its height
    noisy = SurfaceMesh(mesh.vertices + rng.normal(0, noise, mesh.vertices.shape), mesh.faces)
    page, (found,) = without_page_below(validated(noisy))
    assert found.code == "page_below"
    assert f"{step:.1f} mm lower" in found.text or noise
    assert page.vertices[:, 0].max() == pytest.approx(142.0, abs=4 * noise)
    assert found.share == pytest.approx(8.0 / WIDTH, rel=0.6)


@pytest.mark.parametrize(
    "profile",
    [
        curled,
        lambda x: curled(x) + 4.0 * (x > 142.0),  # a flap that lies on the page
        lambda x: curled(x) - 4.0 * (x > 100.0),  # a third of the page
        lambda x: curled(x) - np.clip(x - 136.0, 0.0, 6.0) * 1.5,  # a fold with vertices on its wall
        lambda x: 40.0 * np.abs(x / WIDTH - 0.5),  # a spine
    ],
)
def test_what_is_part_of_the_page_is_kept(profile):
    mesh = validated(leaf(profile))
    assert without_page_below(mesh) == (mesh, [])


def test_the_page_of_the_book_has_its_own_width():
    mesh = leaf(lambda x: -3.0 * (x > 142.0))
    report = restore(mesh, Settings(dpi=50)).report
    np.testing.assert_allclose(report["page_mm"], [142.0, HEIGHT], atol=0.05)
    assert "page_below" in [one["code"] for one in report["findings"]]

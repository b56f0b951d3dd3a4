"""Segments of CT volumes: sheets rolled up several times, as grids with noise, holes and jumps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from oracles.markers import rigid_residual
from restore import Settings, flatten, restore
from restore.errors import NotEnoughSurface
from restore.flattening.ordered_grid import flatten_grid, node_step, points_on_grid, thinned, typical_links
from restore.formats.segment import segment_mesh
from restore.mesh.measures import edge_strain, signed_areas, straight_lengths
from restore.mesh.ordered_grid import GridMesh
from restore.mesh.topology import Topology

RADIUS, PITCH, WINDINGS, STEP, ROWS = 60.0, 15.0, 2.0, 4.0, 30
EXACT = 2e-4  # of the length: patches of five points at the innermost radius, where a link turns by 4°
FEW = 2e-3  # with three hundred points, whose lengths along the surface are estimates
ALONG = 0.999  # correlation of a page's positions with the lines of its grid
NOISY = 1e-3  # the same with noise of a twelfth of a link
NOISE = 0.3


def spiral():
    """A rolled sheet: points (rows, cols, 3), and where they belong on the sheet (rows, cols, 2)."""
    angles = np.linspace(0.0, 2 * np.pi * WINDINGS, 50_000)
    radii = RADIUS + PITCH * angles / (2 * np.pi)
    arcs = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(radii), np.diff(angles) * (radii[1:] + radii[:-1]) / 2))])
    x, y = np.arange(0.0, arcs[-1], STEP), STEP * np.arange(ROWS)
    angle, radius = np.interp(x, arcs, angles), np.interp(x, arcs, radii)
    curve = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.concatenate(
        [np.broadcast_to(curve, (ROWS, *curve.shape)), np.broadcast_to(y[:, None, None], (ROWS, len(x), 1))], axis=2
    )
    return points, np.stack(np.meshgrid(x, -y), axis=-1)


def mesh_of(points, valid=None) -> GridMesh:
    valid = np.ones(points.shape[:2], bool) if valid is None else valid
    return segment_mesh(Path("a.vcps"), points, valid, None)


def off(page, flat, places):
    rest, _ = rigid_residual(page.flat, flat.reshape(-1, 2)[places])
    return float(np.sqrt((rest**2).sum(axis=1).mean()))


@pytest.mark.slow
def test_a_sheet_of_two_windings_comes_out_in_the_order_of_its_grid():
    points, flat = spiral()
    mesh = mesh_of(points)
    page = flatten(mesh)
    assert page.converged
    assert off(page, flat, mesh.places) < EXACT * np.ptp(flat)
    assert (signed_areas(page.flat, page.faces) > 0).all()
    grid = page.flat.reshape(*mesh.shape, 2)
    assert (np.diff(grid[..., 0], axis=1) > 0).all()  # columns to the right
    assert (np.diff(grid[..., 1], axis=0) < 0).all()  # rows down
    np.testing.assert_array_equal(page.vertices, mesh.vertices)


def test_noise_does_not_lengthen_the_page():
    points, flat = spiral()
    noisy = points + np.random.default_rng(3).normal(scale=NOISE, size=points.shape)
    mesh = mesh_of(noisy)
    page = flatten(mesh)
    assert off(page, flat, mesh.places) < NOISY * np.ptp(flat)
    edges = Topology(mesh.faces).edges
    naive = straight_lengths(noisy.reshape(-1, 3), edges).sum() / straight_lengths(flat.reshape(-1, 2), edges).sum()
    ours = page.lengths.sum() / straight_lengths(flat.reshape(-1, 2), edges).sum()
    assert abs(ours - 1.0) < 0.2 * abs(naive - 1.0)


def test_a_jump_to_the_next_winding_keeps_the_order_and_shows_in_the_strain():
    points, flat = spiral()
    jumped = np.zeros(points.shape[:2], bool)
    jumped[8:20, 60:100] = True
    radius = np.linalg.norm(points[..., :2], axis=2)
    wrong = points.copy()
    wrong[..., :2] *= np.where(jumped, 1.0 + PITCH / radius, 1.0)[..., None]
    mesh = mesh_of(wrong)
    page = flatten(mesh)
    assert off(page, flat, mesh.places) < 5 * EXACT * np.ptp(flat)
    edges = Topology(mesh.faces).edges
    over = jumped.ravel()[edges[:, 0]] != jumped.ravel()[edges[:, 1]]
    strain = np.abs(edge_strain(page.flat, edges, page.lengths))
    assert strain[over].min() > 0.5
    assert np.median(strain[~over]) < 0.01


def test_holes_stay_holes_and_an_island_keeps_its_place():
    points, flat = spiral()
    valid = np.ones(points.shape[:2], bool)
    valid[10:14, 30:40] = False
    valid[:, 70:73] = False  # parts the grid in two
    mesh = mesh_of(points, valid)
    page = flatten(mesh)
    assert len(page.flat) == valid.sum()
    for part in (mesh.places % mesh.shape[1] < 70, mesh.places % mesh.shape[1] > 72):
        rest, _ = rigid_residual(page.flat[part], flat.reshape(-1, 2)[mesh.places[part]])
        assert np.sqrt((rest**2).sum(axis=1).mean()) < 2 * EXACT * np.ptp(flat)


def test_a_thinned_page_has_the_positions_of_the_whole_one():
    points, _ = spiral()
    mesh = mesh_of(points)
    whole, few = flatten_grid(mesh, len(mesh.vertices), 500)
    chosen = thinned(mesh, 500)
    assert 300 < len(few.vertices) < 800
    np.testing.assert_array_equal(few.vertices, whole.vertices[np.searchsorted(mesh.places, chosen.places)])
    np.testing.assert_allclose(few.flat, whole.flat[np.searchsorted(mesh.places, chosen.places)])
    assert len(few.lengths) == len(Topology(few.faces).edges)


@pytest.mark.parametrize("facing", [1, -1], ids=["", "from behind"])
@pytest.mark.parametrize("method", ["sticks", "conformal"])
def test_other_methods_keep_the_order_of_the_grid_too(method, facing):
    points, flat = spiral()
    mesh = thinned(mesh_of(points * [1, 1, facing]), 300)  # by sticks one of the two comes out mirrored
    page = flatten(mesh, method)
    assert off(page, flat, mesh.places) < FEW * np.ptp(flat)
    rows, cols = np.divmod(mesh.places, mesh.shape[1])
    assert (signed_areas(page.flat, page.faces) > 0).all()
    assert np.corrcoef(page.flat[:, 0], cols)[0, 1] > ALONG
    assert np.corrcoef(page.flat[:, 1], -rows)[0, 1] > ALONG


def test_the_strain_of_a_page_is_that_of_its_grid_and_not_of_the_points_that_are_asked_for():
    points, _ = spiral()
    few, many = (restore(mesh_of(points), Settings(points=count, dpi=30)).report for count in (300, 1000))
    assert few["points"] < many["points"]
    assert few["strain"] == many["strain"] and few["page_mm"] == many["page_mm"]
    assert few["strain"]["rms"] < EXACT


def test_the_nodes_lie_the_farther_apart_the_more_noise_there_is():
    points, _ = spiral()
    steps = []
    for noise in (0.0, 0.05, 0.5):
        noisy = points + np.random.default_rng(1).normal(scale=noise, size=points.shape)
        steps.append(node_step(noisy, STEP))
    assert steps == sorted(steps)
    assert steps[0] == 1 < steps[-1]


def test_links_that_jump_are_beyond_the_limit_and_ordinary_ones_are_not():
    points, _ = spiral()
    for middle, limit in typical_links(points + np.random.default_rng(1).normal(scale=0.2, size=points.shape)):
        assert middle == pytest.approx(STEP, rel=0.05)
        assert STEP * 1.2 < limit < PITCH


def test_the_grid_and_the_mesh_are_one():
    points, _ = spiral()
    valid = np.random.default_rng(1).random(points.shape[:2]) < 0.9
    mesh = mesh_of(points, valid)
    again = points_on_grid(mesh)
    np.testing.assert_array_equal(again.reshape(-1, 3)[mesh.places], mesh.vertices)
    assert np.isnan(again).any(axis=2).sum() == points[..., 0].size - len(mesh.places)


def test_a_grid_of_loose_cells_is_refused():
    points, _ = spiral()
    mesh = mesh_of(points[:2, :2])
    with pytest.raises(NotEnoughSurface, match="neighbouring points"):
        flatten(mesh)


def test_a_grid_whose_points_lie_on_a_line_is_refused():
    line = np.stack(np.broadcast_arrays(np.arange(30.0), 3.0, np.ones((20, 1))), axis=-1)
    with pytest.raises(NotEnoughSurface, match="on a line"):
        flatten(mesh_of(line))


def test_rows_that_are_stored_twice_leave_lengths_to_divide_by():
    points, _ = spiral()
    page = flatten(mesh_of(np.concatenate([points[:20], points[19:]])))
    assert np.isfinite(edge_strain(page.flat, Topology(page.faces).edges, page.lengths)).all()


def test_other_methods_take_a_grid_as_any_mesh():
    rows, cols = np.indices((12, 12))
    mesh = mesh_of(np.dstack([5.0 * cols, 5.0 * rows, np.full(rows.shape, 100.0)]))
    page = flatten(replace(mesh), "conformal")
    rest, _ = rigid_residual(page.flat, np.column_stack([5.0 * cols.ravel(), -5.0 * rows.ravel()]))
    assert np.abs(rest).max() < 1e-6  # mm: a plane

"""Meshes of many vertices come out as true as small ones, noise or not, however they lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.sheets import Curl, Sheet
from oracles.exact import ExactSheet, exact_sheet
from oracles.markers import rigid_residual
from restore import BadInput, NotEnoughSurface, flatten
from restore.flattening.methods import flatten_points
from restore.flattening.published import springs
from restore.mesh.measures import flipped_faces
from restore.mesh.network import make_network
from restore.mesh.topology import Topology
from restore.page import FlatMesh
from restore.prepared import flatten as flatten_mesh
from restore.range_image.resample import MIN_VERTICES
from restore.scan import SurfaceMesh

POINTS = MIN_VERTICES + 1000
CURL = Curl()
ROLL = Curl(radius_mm=70.0, taper=0.0)  # 230° round: no view sees all of it
NOISE_MM = 0.1  # the scanner's; chords of this mesh, 1.2 mm long, grow by 0.8 %: 2 mm over the page
CLEAN_MM = 1e-3  # rms: the lengths along the surface are exact to this over the page
NOISY_MM = 0.1  # rms: what is asked of the whole grid with the same noise
ROLL_MM = 0.5  # rms: smoothing a roll by its own vertices draws it in by a thousandth; 0.27 measured
SAME_MM = 0.02  # two grids over the same surface


@pytest.fixture(scope="module")
def curl() -> ExactSheet:
    return exact_sheet(CURL, POINTS)


def rms_mm(flat, truth) -> float:
    return float(np.sqrt((rigid_residual(flat, truth)[0] ** 2).sum(axis=1).mean()))


@pytest.fixture(scope="module")
def seen() -> ExactSheet:
    return noisy(CURL)


@pytest.fixture(scope="module")
def page(seen) -> FlatMesh:
    return flatten(seen.mesh)


def noisy(sheet: Sheet) -> ExactSheet:
    return exact_sheet(sheet, POINTS, noise_mm=NOISE_MM)


def chords(mesh: SurfaceMesh) -> float:
    """Sum of all edges, mm."""
    return float(make_network(mesh.vertices, Topology(mesh.faces)).lengths.sum())


def test_a_clean_mesh_comes_out_true_at_all_its_vertices(curl):
    page = flatten(curl.mesh)
    assert rms_mm(page.flat, curl.flat) < CLEAN_MM
    assert flipped_faces(page.flat, page.faces) == 0
    np.testing.assert_allclose(page.lengths, curl.lengths, rtol=1e-3)


def test_noise_along_the_line_of_sight_neither_inflates_nor_bends_the_page(seen, page):
    assert chords(seen.mesh) > 1.003 * seen.lengths.sum()  # the noise would be seen
    assert rms_mm(page.flat, seen.flat) < NOISY_MM
    assert flipped_faces(page.flat, page.faces) == 0
    assert page.lengths.sum() < 1.001 * seen.lengths.sum()


def test_vertices_that_noise_put_beyond_their_neighbours_turn_no_face_over():
    """Ten times the scanner's noise, nearly as much as the vertices are apart."""
    page = flatten(exact_sheet(CURL, POINTS, noise_mm=10 * NOISE_MM).mesh)
    assert flipped_faces(page.flat, page.faces) == 0


def test_a_roll_that_no_view_sees_whole_is_flattened_over_its_points():
    sheet = noisy(ROLL)
    page = flatten(sheet.mesh)
    assert rms_mm(page.flat, sheet.flat) < ROLL_MM
    assert flipped_faces(page.flat, page.faces) == 0


def test_only_the_roll_is_not_seen_whole(curl):
    assert flatten_mesh.resample(curl.mesh) is not None
    roll = exact_sheet(ROLL, POINTS)
    assert flatten_mesh.resample(roll.mesh) is None
    assert rms_mm(flatten(roll.mesh).flat, roll.flat) < CLEAN_MM


def test_a_small_piece_next_to_a_large_one_settles_by_itself(seen):
    small = exact_sheet(Curl(radius_mm=100.0, taper=0.0), 400, page_mm=(80.0, 60.0))
    apart = small.mesh.vertices + [0.0, 250.0, 0.0]
    mesh = SurfaceMesh(
        np.vstack([apart, seen.mesh.vertices]), np.vstack([small.mesh.faces, seen.mesh.faces + len(apart)])
    )
    both = flatten(mesh)
    first, second = np.split(both.flat, [len(apart)])
    assert rms_mm(first, small.flat) < CLEAN_MM
    assert rms_mm(second, seen.flat) < NOISY_MM
    assert np.ptp(second[:, 1]) / 2 + 30 < first[:, 1].mean() - second[:, 1].mean() < 260  # above, as in space
    assert both.lengths.shape == (len(Topology(mesh.faces).edges),)


def test_turned_over_scaled_and_shuffled_it_is_the_same_page(seen, page):
    random = np.random.default_rng(0)
    order = random.permutation(POINTS)
    turn = Rotation.random(random_state=random).as_matrix()
    faces = random.permutation(np.argsort(order)[seen.mesh.faces])
    other = SurfaceMesh(2.0 * seen.mesh.vertices[order] @ turn.T + [5.0, -300.0, 40.0], faces)
    flat = np.empty_like(seen.flat)
    flat[order] = flatten(other).flat
    assert rms_mm(flat / 2.0, page.flat) < SAME_MM


def test_given_lengths_are_kept_at_any_size(curl, monkeypatch):
    monkeypatch.setattr(flatten_mesh, "MIN_VERTICES", 100)
    few = exact_sheet(CURL, 500)
    stretched = 1.01 * few.lengths
    page = flatten(few.mesh, lengths=stretched)
    np.testing.assert_array_equal(page.lengths, stretched)
    assert rms_mm(page.flat / 1.01, few.flat) < SAME_MM


def test_convergence_is_reported_at_any_size(curl, monkeypatch):
    """Steps of springs that are ended early."""
    assert flatten(curl.mesh).converged
    monkeypatch.setattr(springs, "MAX_STEPS", 3)
    page = flatten(curl.mesh, "springs")
    assert not page.converged
    assert page.residual > 0.0


def test_below_the_limit_all_vertices_settle():
    few = exact_sheet(CURL, 500)
    np.testing.assert_array_equal(flatten(few.mesh).flat, flatten_points(few.mesh).flat)


def test_wrong_values_are_reported(curl):
    broken = curl.mesh.vertices.copy()
    broken[7] = np.nan
    with pytest.raises(BadInput, match="finite"):
        flatten(replace(curl.mesh, vertices=broken))
    with pytest.raises(BadInput, match="the flattening method 'magic' does not exist"):
        flatten(curl.mesh, "magic")
    with pytest.raises(NotEnoughSurface):
        flatten(replace(curl.mesh, faces=curl.mesh.faces[:0]))

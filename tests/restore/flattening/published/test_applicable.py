"""The applicable surface (Pilu, CVPR 2001): a lattice of known flat lengths, bent onto the vertices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.sheets import Cone, Curl, Flat, MultiFold, Wave
from oracles.exact import ExactSheet, exact_sheet
from oracles.markers import rigid_residual
from restore.errors import BadInput
from restore.flattening.conformal import flatten_conformal
from restore.flattening.published.applicable import MARGIN, flatten_applicable, lattice_over, slid
from restore.mesh.measures import flipped_faces, straight_lengths
from restore.mesh.network import make_network
from restore.mesh.pose import pose_on_table
from restore.mesh.topology import Topology

POINTS = 400
ROUNDING_MM = 1e-6  # rms: a plane needs no step, its feet are those of the conformal map
RADIUS_MM = 70.0
STEP_MM = 12.0  # of the lattice over POINTS vertices
# A polygon of sides h along a bend of radius r is h² / 24 r² longer than the arc that it is fitted to; half a page of
# 280 mm is off by so much at its ends, and by less elsewhere.
ROLL_MM = 140.0 * (STEP_MM / RADIUS_MM) ** 2 / 24.0
SMOOTH_MM = {"cone": 0.05, "wave": 0.3}  # rms, the same at their radii, which vary
SAME = 2e-3  # of a page's cell: iterations end by the energy, a step earlier or later in another frame
A_MILLIMETRE = 1.0
ROLL = Curl(radius_mm=RADIUS_MM, taper=0.0)


def flattened(sheet: ExactSheet):
    return flatten_applicable(sheet.posed(), sheet.network(chords=True))


def test_a_flat_sheet_stays_and_is_not_mirrored():
    sheet = exact_sheet(Flat(), POINTS)
    found = flattened(sheet)
    assert rms_mm(found.flat, sheet) < ROUNDING_MM
    assert rms_mm(found.flat * [-1, 1], sheet) > A_MILLIMETRE  # the measure would see a mirrored page


def test_a_roll_past_upright_comes_out_to_the_length_of_its_arc():
    sheet = exact_sheet(ROLL, POINTS)
    found = flattened(sheet)
    assert found.converged
    assert rms_mm(found.flat, sheet) < ROLL_MM
    assert flipped_faces(found.flat, sheet.mesh.faces) == 0


@pytest.mark.parametrize(("name", "shape"), [("cone", Cone()), ("wave", Wave())])
def test_smooth_sheets_come_out_flat(name, shape):
    sheet = exact_sheet(shape, POINTS)
    assert rms_mm(flattened(sheet).flat, sheet) < SMOOTH_MM[name]


def test_folds_are_nearer_to_the_truth_than_the_conformal_map_it_starts_from():
    sheet = exact_sheet(MultiFold(), POINTS)
    start = flatten_conformal(sheet.posed(), sheet.network(chords=True)).flat
    assert rms_mm(flattened(sheet).flat, sheet) < 0.5 * rms_mm(start, sheet)  # a quarter was measured


def test_noise_off_the_surface_hardly_moves_the_page():
    clean, noisy = (exact_sheet(ROLL, POINTS, noise_mm=noise) for noise in (0.0, 0.1))
    assert rms_mm(flattened(noisy).flat, noisy) < 2.0 * rms_mm(flattened(clean).flat, clean)


@settings(max_examples=5, deadline=None)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3), shift=st.tuples(*[st.floats(-500, 500)] * 3), scale=st.floats(0.1, 10))
def test_moved_and_scaled_sheets_give_the_same_page(turn, shift, scale):
    mesh = exact_sheet(ROLL, 200).mesh
    moved = scale * mesh.vertices @ Rotation.from_rotvec(turn).as_matrix().T + shift
    pages = [
        flatten_applicable(pose_on_table(vertices, mesh.faces), make_network(vertices, Topology(mesh.faces))).flat
        for vertices in (mesh.vertices, moved)
    ]
    assert np.abs(rigid_residual(pages[1] / scale, pages[0])[0]).max() < SAME * STEP_MM


def test_every_step_can_be_followed_and_the_last_is_the_page():
    sheet, seen = exact_sheet(MultiFold(), POINTS), []
    found = flatten_applicable(
        sheet.posed(), sheet.network(chords=True), lambda *step: seen.append((step[0], step[1].copy()))
    )
    assert [step for step, _ in seen] == list(range(1, found.iterations + 1))
    np.testing.assert_array_equal(seen[-1][1], np.column_stack([found.flat, np.zeros(len(found.flat))]))


def test_the_lattice_covers_the_page_with_a_margin_whichever_way_it_lies():
    flat = np.random.default_rng(1).random((500, 2)) * [280.0, 200.0]
    for angle in (0.0, 1.0, 2.5):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        lattice, feet = lattice_over(flat @ turn)
        assert feet.min(axis=0) == pytest.approx([MARGIN, MARGIN])
        assert (feet.max(axis=0) <= [lattice.cols - 1 - MARGIN, lattice.rows - 1 - MARGIN]).all()
        assert lattice.cols > lattice.rows
        off = rigid_residual(lattice.step * feet, flat)[0]  # a motion without a reflection
        assert np.abs(off).max() < ROUNDING_MM


def test_the_flat_lattice_has_the_lengths_that_its_cells_keep():
    lattice, _ = lattice_over(np.random.default_rng(1).random((100, 2)) * [3.0, 2.0])
    pairs, spans = lattice.sides()
    np.testing.assert_allclose(straight_lengths(flat_nodes(lattice), pairs), spans)
    cells = (lattice.rows - 1) * (lattice.cols - 1)
    assert len(pairs) == 4 * cells + lattice.rows + lattice.cols - 2  # two diagonals, two sides, and the last sides


def test_feet_on_a_plane_are_found_in_one_step_and_none_moves_away():
    lattice, feet = lattice_over(np.random.default_rng(1).random((100, 2)) * [3.0, 2.0])
    true = feet + np.random.default_rng(2).uniform(-0.5, 0.5, feet.shape)
    points = np.column_stack([lattice.step * true, np.full(len(true), 0.1)])
    found = slid(lattice, flat_nodes(lattice), feet, points)
    np.testing.assert_allclose(found, true, atol=ROUNDING_MM)
    np.testing.assert_array_equal(slid(lattice, flat_nodes(lattice), found, points).round(6), found.round(6))


def test_sheets_that_meet_in_a_single_point_are_refused():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 3, 4]])
    with pytest.raises(BadInput, match="single points"):
        flatten_applicable(pose_on_table(vertices, faces), make_network(vertices, Topology(faces)))


def test_a_dome_ends_in_finite_positions():
    x, y = np.meshgrid(np.linspace(-1, 1, 15), np.linspace(-1, 1, 15))
    dome = 100.0 * np.stack([x, y, np.sqrt(np.maximum(2.1 - x**2 - y**2, 0.0))], axis=2).reshape(-1, 3)
    k = np.arange(14 * 15).reshape(14, 15)[:, :-1].ravel()
    faces = np.concatenate([np.stack([k, k + 1, k + 15], 1), np.stack([k + 1, k + 16, k + 15], 1)])
    found = flatten_applicable(pose_on_table(dome, faces), make_network(dome, Topology(faces)))
    assert np.isfinite(found.flat).all()


def flat_nodes(lattice):
    rows, cols = np.divmod(np.arange(lattice.count), lattice.cols)
    return lattice.step * np.column_stack([cols, rows, np.zeros(lattice.count)])


def rms_mm(flat, sheet: ExactSheet) -> float:
    return float(np.sqrt((rigid_residual(flat, sheet.flat)[0] ** 2).sum(axis=1).mean()))

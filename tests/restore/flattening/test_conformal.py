"""The least-squares conformal map (Lévy et al. 2002) with its scale restored (Brown & Pisula, CVPR 2005)."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from drivers.simulated.scene.sheets import Curl, Flat, MultiFold, Spread, Wave
from oracles.exact import ExactSheet, exact_sheet
from oracles.markers import rigid_residual
from restore.errors import BadInput
from restore.flattening.conformal import conformal_map, flatten_conformal, unfolded
from restore.mesh.measures import flipped_faces, signed_areas, surface_area
from restore.mesh.network import make_network
from restore.mesh.pose import pose_on_table
from restore.mesh.topology import Topology

POINTS = 1000
EXACT_MM = 1e-6  # rms; with true lengths the map is exact: what the solve rounds off is left
CHORD_MM = 6.0  # rms; straight chords leave no conformal map: 0.01 mm (curl) to 4.3 mm (sharp gutter) measured
ROUNDING = 1e-9  # relative, of a solve with condition 1e6
A_MILLIMETRE = 1.0
SHEETS = {
    "curl up": Curl(),
    "curl down": Curl(radius_mm=-170.0),
    "roll past upright": Curl(radius_mm=60.0, taper=0.0),
    "fold": MultiFold(),
    "wave": Wave(),
    "gutter": Spread(),
}


@pytest.mark.parametrize("name", SHEETS)
def test_true_lengths_give_the_page_exactly(name):
    sheet = exact_sheet(SHEETS[name], POINTS)
    flat, steps, *_ = flatten_conformal(sheet.posed(), sheet.network())
    assert steps == 1
    assert rms_mm(flat, sheet) < EXACT_MM
    assert flipped_faces(flat, sheet.mesh.faces) == 0


@pytest.mark.parametrize("name", SHEETS)
def test_chords_give_the_page_nearly_and_the_area_of_the_surface(name):
    sheet = exact_sheet(SHEETS[name], POINTS)
    flat, *_ = flatten_conformal(sheet.posed(), sheet.network(chords=True))
    assert EXACT_MM < rms_mm(flat, sheet) < CHORD_MM
    area = surface_area(sheet.mesh.vertices, sheet.mesh.faces)
    assert signed_areas(flat, sheet.mesh.faces).sum() == pytest.approx(area, rel=ROUNDING)


def test_a_flat_sheet_stays_and_is_not_mirrored():
    sheet = exact_sheet(Flat(), POINTS)
    flat, *_ = flatten_conformal(sheet.posed(), sheet.network())
    assert rms_mm(flat, sheet) < EXACT_MM
    assert rms_mm(flat * [-1, 1], sheet) > A_MILLIMETRE  # the measure would see a mirrored page


@settings(max_examples=10, deadline=None)
@given(turn=st.tuples(*[st.floats(-3, 3)] * 3), shift=st.tuples(*[st.floats(-500, 500)] * 3), scale=st.floats(0.1, 10))
def test_moved_and_scaled_sheets_give_the_same_page(turn, shift, scale):
    """Up to a turn in the plane: which way is right depends on how the scanner saw the sheet."""
    sheet = exact_sheet(Wave(), 200)
    mesh = sheet.mesh
    moved = scale * mesh.vertices @ Rotation.from_rotvec(turn).as_matrix().T + shift
    pages = [
        flatten_conformal(pose_on_table(vertices, mesh.faces), make_network(vertices, Topology(mesh.faces)))[0]
        for vertices in (mesh.vertices, moved)
    ]
    assert np.abs(rigid_residual(pages[1] / scale, pages[0])[0]).max() < EXACT_MM


def test_the_only_step_can_be_followed():
    sheet, seen = exact_sheet(MultiFold(), POINTS), []
    flat, *_ = flatten_conformal(sheet.posed(), sheet.network(), lambda step, positions: seen.append((step, positions)))
    [(step, positions)] = seen
    assert step == 1
    np.testing.assert_array_equal(positions, np.column_stack([flat, np.zeros(len(flat))]))


def test_any_complex_polynomial_of_first_degree_is_left_as_it_is():
    """u = az + b is conformal; held at 0 and 1 it is (z − z₀) / (z₁ − z₀)."""
    sheet = exact_sheet(Flat(), POINTS)
    z = sheet.flat[:, 0] + 1j * sheet.flat[:, 1]
    corners = unfolded(sheet.network())
    mapped = conformal_map(sheet.mesh.faces, corners, (3, 700))
    np.testing.assert_allclose(mapped, (z - z[3]) / (z[700] - z[3]), atol=ROUNDING)


def test_unfolded_faces_keep_their_sides():
    network = exact_sheet(Curl(), POINTS).network()
    corners = unfolded(network)
    points = np.stack([corners.real, corners.imag], axis=2).reshape(-1, 2)
    sides = np.abs(corners - corners[:, [1, 2, 0]])
    ends = np.sort(network.faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
    known = {tuple(edge): length for edge, length in zip(network.edges.tolist(), network.lengths, strict=True)}
    expected = [[known[tuple(edge)] for edge in face] for face in ends.tolist()]
    np.testing.assert_allclose(sides, expected, rtol=ROUNDING)
    assert (signed_areas(points, np.arange(len(points)).reshape(-1, 3)) > 0).all()


def test_a_doubled_point_does_not_part_a_sheet():
    sheet = exact_sheet(Flat(), 300)
    vertices = sheet.mesh.vertices.copy()
    vertices[sheet.mesh.faces[7, 1]] = vertices[sheet.mesh.faces[7, 0]]
    flat = flatten_conformal(
        pose_on_table(vertices, sheet.mesh.faces), make_network(vertices, Topology(sheet.mesh.faces))
    ).flat
    assert rms_mm(flat, sheet) < 2.0 * A_MILLIMETRE  # one of 300 is off by its spacing, 14 mm


def test_sheets_that_meet_in_a_single_point_are_refused():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0.0]])
    faces = np.array([[0, 1, 2], [0, 3, 4]])
    with pytest.raises(BadInput, match="single points"):
        flatten_conformal(pose_on_table(vertices, faces), make_network(vertices, Topology(faces)))


def test_a_closed_surface_is_refused_as_its_map_covers_nothing():
    corners = np.array([[0.0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    with pytest.raises(BadInput, match="closed all round"):
        flatten_conformal(pose_on_table(corners, faces), make_network(corners, Topology(faces)))


def test_lengths_that_no_triangle_has_give_a_finite_page():
    sheet = exact_sheet(Flat(), 200)
    lengths = sheet.lengths.copy()
    lengths[::17] *= 4.0  # longer than the two other sides together
    network = make_network(sheet.mesh.vertices, Topology(sheet.mesh.faces), lengths)
    flat, *_ = flatten_conformal(sheet.posed(), network)
    assert np.isfinite(flat).all()


def rms_mm(flat, sheet: ExactSheet) -> float:
    return float(np.sqrt((rigid_residual(flat, sheet.flat)[0] ** 2).sum(axis=1).mean()))

"""A sheet is laid on the table printed side up, and the flat page put back where the scanner saw it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from restore.mesh.pose import move_upright, pose_on_table

EXACT = 1e-9  # mm

turns = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)
shifts = st.tuples(*[st.floats(-500.0, 500.0)] * 3)


def moved(page, turn, shift):
    return page.mesh.vertices @ Rotation.from_quat(turn).as_matrix().T + shift


@settings(max_examples=30, deadline=None)
@given(turns, shifts)
def test_a_laid_sheet_is_the_same_sheet_on_the_table_and_centred(warped, turn, shift):
    page = warped("curl", count=60)
    vertices = moved(page, turn, shift)
    posed = pose_on_table(vertices, page.mesh.faces)
    np.testing.assert_allclose(posed.axes @ posed.axes.T, np.eye(3), atol=EXACT)
    assert np.linalg.det(posed.axes) == pytest.approx(1.0)
    np.testing.assert_allclose(posed.positions @ posed.axes + posed.origin, vertices, atol=1e3 * EXACT)
    np.testing.assert_allclose(posed.positions[:, 2].min(), 0.0, atol=1e3 * EXACT)
    np.testing.assert_allclose(posed.weights @ posed.positions[:, :2], 0.0, atol=1e3 * EXACT)
    assert posed.weights.sum() == pytest.approx(1.0)
    a, b, c = (posed.positions[page.mesh.faces[:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].sum() > 0  # printed side up


@settings(max_examples=30, deadline=None)
@given(turns, shifts)
def test_however_the_sheet_was_turned_it_lies_on_the_table_in_the_same_shape(warped, turn, shift):
    page = warped("gutter", count=60)
    heights = [
        pose_on_table(v, page.mesh.faces).positions[:, 2] for v in (page.mesh.vertices, moved(page, turn, shift))
    ]
    np.testing.assert_allclose(*heights, atol=1e3 * EXACT)


@pytest.mark.parametrize("tilt", ["x", "y", "xy"])
def test_a_page_before_the_scanner_keeps_its_right_and_its_up(warped, tilt):
    page = warped("curl", count=60)
    rotation = Rotation.from_euler(tilt, [25.0] * len(tilt), degrees=True).as_matrix()
    posed = pose_on_table(page.mesh.vertices @ rotation.T, page.mesh.faces)
    assert posed.axes[0] @ [1, 0, 0] > 0.85
    assert posed.axes[1] @ [0, 1, 0] > 0.85
    assert abs(posed.axes[0][1]) < 0.25  # as level as the tilt allows
    np.testing.assert_allclose(posed.axes[2], rotation @ [0, 0, 1], atol=0.05)  # the curl's points are irregular


def test_a_page_seen_edge_on_has_a_right_too(warped):
    page = warped(count=60)
    for degrees in (90.0, -90.0):
        turn = Rotation.from_euler("y", degrees, degrees=True).as_matrix()
        posed = pose_on_table(page.mesh.vertices @ turn.T, page.mesh.faces)
        np.testing.assert_allclose(posed.axes, turn.T, atol=EXACT)


def test_a_tube_lies_on_its_principal_axes():
    """Its normals point everywhere and cancel."""
    around = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([30 * np.cos(around), 20 * np.sin(around)])
    vertices = np.vstack([np.column_stack([ring[:, 0], np.full(24, y), ring[:, 1]]) for y in (-80.0, 80.0)])
    k = np.arange(24)
    after = (k + 1) % 24
    faces = np.vstack([np.column_stack([k, k + 24, after]), np.column_stack([after, k + 24, after + 24])])
    posed = pose_on_table(vertices, faces)
    assert abs(posed.axes[2] @ [0, 0, 1]) == pytest.approx(1.0)
    assert np.isfinite(posed.positions).all()


@settings(max_examples=30, deadline=None)
@given(st.floats(-np.pi, np.pi), st.tuples(*[st.floats(-300.0, 300.0)] * 2))
def test_upright_puts_a_flat_page_back_wherever_the_solver_left_it(warped, angle, shift):
    page = warped(count=60)
    posed = pose_on_table(page.mesh.vertices, page.mesh.faces)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(move_upright(page.flat @ turn + shift, posed), page.flat, atol=1e3 * EXACT)


def test_upright_never_scales_and_never_mirrors(warped):
    page = warped(count=60)
    posed = pose_on_table(page.mesh.vertices, page.mesh.faces)
    half = move_upright(page.flat * 0.5, posed)
    found, before = (np.linalg.norm(flat - flat[0], axis=1) for flat in (half, page.flat))
    np.testing.assert_allclose(found, 0.5 * before)
    mirrored = move_upright(page.flat * [-1, 1], posed)
    sides = [np.linalg.det(flat[[1, 40]] - flat[0]) for flat in (page.flat * [-1, 1], mirrored)]
    assert sides[0] == pytest.approx(sides[1])

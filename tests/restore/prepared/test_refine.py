"""Flat positions over the grid: exact for affine fields, inside the mesh and past its border."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from oracles.markers import rigid_residual
from restore.mesh.topology import Topology
from restore.mesh.triangulate import lattice
from restore.page import FlatMesh
from restore.prepared.refine import interpolate_flat_positions, refine

SHAPE = (60, 80)
SINGLE = 1e-4  # mm: the rasteriser fills triangles in single precision, of coordinates up to 500 mm
PLANE_MM = 0.01  # rms on an exact plane: what relaxation to convergence leaves, far below a sample's 0.47 mm

inside = np.zeros(SHAPE, bool)
inside[10:50, 12:70] = True
affine_maps = arrays(float, (2, 3), elements=st.floats(-3, 3))
places = arrays(float, (6, 2), elements=st.floats(12, 47))


def test_the_lattice_here_covers_the_mask():
    nodes, _ = lattice(inside, 8)
    assert nodes.min(axis=0) == pytest.approx([9.5, 11.5])
    assert nodes.max(axis=0) == pytest.approx([49.5, 69.5])


@given(affine=affine_maps, wanted=places)
def test_an_affine_field_is_interpolated_exactly(affine, wanted):
    nodes, faces = lattice(inside, 8)
    flat = nodes @ affine[:, :2].T + affine[:, 2]
    np.testing.assert_allclose(
        interpolate_flat_positions(SHAPE, nodes, faces, flat, wanted),
        wanted @ affine[:, :2].T + affine[:, 2],
        atol=SINGLE,
    )


@given(affine=affine_maps)
def test_past_the_border_an_affine_field_goes_on_as_it_is(affine):
    nodes, faces = lattice(inside, 8)
    flat = nodes @ affine[:, :2].T + affine[:, 2]
    beyond = np.array([[5.0, 30.0], [54.0, 30.0], [30.0, 6.0], [30.0, 75.0], [6.0, 8.0]])
    np.testing.assert_allclose(
        interpolate_flat_positions(SHAPE, nodes, faces, flat, beyond),
        beyond @ affine[:, :2].T + affine[:, 2],
        atol=10 * SINGLE,
    )


def test_a_plane_is_refined_to_its_own_lengths(camera):
    sheet = camera.sheet(camera.facets(camera.plane((0.3, -0.2, 1.0))))
    nodes, faces = lattice(sheet.inside, 24)
    vertices = sheet.points(nodes)
    normal = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    right = np.cross([0.0, 1.0, 0.0], normal)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(normal, right)])
    coarse = FlatMesh(vertices, faces, flat=vertices @ axes.T, lengths=sheet.lengths(nodes, Topology(faces).edges))
    fine, fine_nodes = refine(sheet, coarse, nodes)
    assert len(fine.vertices) > 10 * len(vertices)
    np.testing.assert_allclose(fine.vertices, sheet.points(fine_nodes))
    residual, scale = rigid_residual(fine.flat, sheet.points(fine_nodes) @ axes.T)
    assert np.sqrt((residual**2).sum(axis=1).mean()) < PLANE_MM
    assert scale == pytest.approx(1.0, abs=1e-4)  # PLANE_MM over the 94 mm of the sheet
    assert fine.converged
    astray = replace(coarse, residual=0.5, converged=False)  # whatever is made of it
    assert refine(sheet, astray, nodes)[0].convergence == astray.convergence

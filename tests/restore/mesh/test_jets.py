"""Patches of known surfaces: their normals, their curvature, how far they pass by noisy vertices."""

import numpy as np
import pytest

from oracles.exact import scatter_points
from restore.mesh import jets as module
from restore.mesh.jets import MAX_NEIGHBOURS, TERMS, fit_jets, rings_of, row_of
from restore.mesh.topology import Topology

PATCH_MM = (60.0, 40.0)
INNER_MM = np.array([24.0, 14.0])  # two rings from the border: patches there have neighbours on all sides
CURVED = np.array([[0.004, -0.002], [-0.002, 0.003]])  # 1/mm
STILL = 1e-9  # mm: noise of a surface that has none
# Patches stand on the plane of a face, where a quadratic surface is one only to second order, and flat is their prior.
NORMAL_RAD = 1e-4
CURVATURE = 1e-4  # 1/mm, of 5.6e-3
SLOPE = np.deg2rad(30.0)
ADJACENT_MM = 6.0  # two rings: beyond, no patch has neighbours on the other side of the crease
ON_CREASE_MM = 0.1  # nearer, a vertex is of both sides
ROUNDING = 1e-9
PARITY = 1e-9
NOISE_MM = 0.02
# A patch of 6 terms through 19 vertices, of which it believes the far ones less, takes up a part of each one’s noise.
NOISE_FRACTION = (0.7, 1.0)


@pytest.fixture(scope="module")
def plane():
    flat, faces = scatter_points(600, PATCH_MM, np.random.default_rng(0))
    return flat, faces, Topology(faces).edges


def fit(flat, height, faces, edges, noise=STILL):
    vertices = np.column_stack([flat, height])
    return fit_jets(vertices, rings_of(vertices, faces, edges), np.arange(len(flat)), noise)


def test_a_quadratic_surface_gets_its_normals_and_curvatures(plane):
    flat, faces, edges = plane
    found = fit(flat, 0.5 * np.einsum("ni,ij,nj->n", flat, CURVED, flat), faces, edges)
    slope = flat @ CURVED
    steep = np.sqrt(1 + (slope**2).sum(axis=1))
    normals = np.column_stack([-slope, np.ones(len(flat))]) / steep[:, None]
    inner = (np.abs(flat) < INNER_MM).all(axis=1)
    assert np.linalg.norm(found.normals - normals, axis=1)[inner].max() < NORMAL_RAD
    assert np.abs(found.offsets).max() < STILL
    # The normal curvature along three directions of the surface: the second derivative over the length there.
    for across in ([1.0, 0.0], [0.0, 1.0], [0.6, -0.8]):
        way = np.column_stack([np.broadcast_to(across, flat.shape), slope @ across])
        true = across @ CURVED @ across / steep / (way**2).sum(axis=1)
        unit = way / np.linalg.norm(way, axis=1)[:, None]
        curvature = np.einsum("ni,nij,nj->n", unit, found.forms, unit)
        assert np.abs(curvature - true)[inner].max() < CURVATURE
        assert np.abs(true)[inner].min() > 3 * CURVATURE  # the measure would see it


def test_next_to_a_crease_a_patch_keeps_to_its_own_side(plane):
    flat, faces, edges = plane
    off = flat[:, 0] - 1.3
    found = fit(flat, np.tan(SLOPE) * np.abs(off), faces, edges)
    own = np.column_stack([-np.sign(off) * np.sin(SLOPE), 0 * off, np.full(len(off), np.cos(SLOPE))])
    angle = np.arccos(np.clip((found.normals * own).sum(axis=1), -1, 1))
    assert angle[np.abs(off) > ADJACENT_MM].max() < np.sqrt(ROUNDING)  # the arc cosine halves the digits
    # A mean of both sides would lean by up to 30°; nearly all vertices at the crease see one side alone.
    assert np.mean(angle[np.abs(off) < ADJACENT_MM] > SLOPE / 6) < 0.1
    assert angle[np.abs(off) > ON_CREASE_MM].max() < SLOPE / 2


def test_patches_pass_by_noisy_vertices_by_their_noise(plane):
    flat, faces, edges = plane
    noise = np.random.default_rng(1).normal(scale=NOISE_MM, size=len(flat))
    loose = fit(flat, noise, faces, edges, noise=1.0).offsets
    assert NOISE_FRACTION[0] < np.sqrt(np.mean(loose**2)) / NOISE_MM < NOISE_FRACTION[1]
    assert np.corrcoef(loose, noise)[0, 1] < -0.8  # from the vertex back to the plane
    tied = fit(flat, noise, faces, edges).offsets
    assert np.abs(tied).max() < STILL


def test_only_the_chosen_vertices_get_a_patch(plane):
    flat, faces, edges = plane
    vertices = np.column_stack([flat, 0 * flat[:, 0]])
    found = fit_jets(vertices, rings_of(vertices, faces, edges), np.array([3, 5]), STILL)
    np.testing.assert_array_equal(np.flatnonzero(found.normals.any(axis=1)), [3, 5])


def test_a_lone_triangle_gets_no_patch():
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    faces = np.array([[0, 1, 2]])
    found = fit_jets(triangle, rings_of(triangle, faces, Topology(faces).edges), np.arange(3), STILL)
    assert not found.normals.any()
    assert not found.offsets.any()


def test_compiled_and_plain_python_agree(plain):
    flat, faces = scatter_points(80, PATCH_MM, np.random.default_rng(2))
    vertices = np.column_stack([flat, 0.003 * flat[:, 0] ** 2 + 0.3 * np.abs(flat[:, 1])])
    work = (vertices, rings_of(vertices, faces, Topology(faces).edges), np.arange(len(flat)), 1e-3)
    compiled = fit_jets(*work)
    assert "_fit_all" in plain(module)
    for one, other in zip(compiled, fit_jets(*work), strict=True):
        np.testing.assert_allclose(one, other, atol=PARITY)


def test_the_linear_solver_solves():
    random = np.random.default_rng(3)
    half = random.normal(size=(TERMS, MAX_NEIGHBOURS))
    matrix, right = half @ half.T, random.normal(size=TERMS)
    triangle = np.concatenate([matrix[np.tril_indices(TERMS)], right])
    solution = np.empty(TERMS)
    module._solve(triangle, solution)
    np.testing.assert_allclose(matrix @ solution, right, atol=PARITY)


def test_the_products_are_those_of_the_normal_equations():
    x, y, z = 0.7, -1.3, 0.4
    terms = np.array([1.0, x, y, x * x / 2, x * y, y * y / 2])
    table = np.empty((1, row_of(TERMS) + TERMS))
    module._multiply(np.array([[x], [y], [z]]), 0, table)
    products = table[0]
    np.testing.assert_allclose(products[:-TERMS], np.outer(terms, terms)[np.tril_indices(TERMS)], atol=PARITY)
    np.testing.assert_allclose(products[-TERMS:], z * terms, atol=PARITY)

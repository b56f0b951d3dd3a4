"""Vertices outside of a bend, where decimation puts them, on cylinders whose lengths are known."""

import numpy as np
import pytest

from oracles.exact import scatter_points
from oracles.markers import rigid_residual
from restore.flattening.methods import flatten_points
from restore.mesh import surface_lengths as lengths_module
from restore.mesh.decimate import decimate
from restore.mesh.decimation_bias import OUTSIDE, _neighbour_heights, correct_decimation_bias, stood_outside
from restore.mesh.jets import fit_jets, rings_of
from restore.mesh.surface_lengths import estimate_noise_sigma, surface_lengths
from restore.mesh.topology import Topology
from restore.scan import SurfaceMesh

RADIUS_MM = 60.0
STEEP_MM = 30.0  # a radius at which neighbours turn by more than the least crease
PATCH_MM = (120.0, 80.0)
POINTS = 800
LEFT = 0.2  # of what the lengths through vertices outside are too long by; 0.06 to 0.1 measured
BACK = 0.05  # of the distance outside; 0.011 measured, as the patches are those of a cylinder that is too wide
NOISE_MM = 0.02  # five times as much as vertices stand outside
PLEATED_MM = 1e-4  # of pages that are exact; the iterations end at 10⁻⁵ of an edge
PARITY = 1e-12


def cylinder(flat, out=0.0, radius=RADIUS_MM):
    turn = flat[:, 0] / radius
    return np.column_stack([(radius + out) * np.sin(turn), flat[:, 1], (radius + out) * np.cos(turn)])


def unrolled(vertices, radius=RADIUS_MM):
    return np.column_stack([radius * np.arctan2(vertices[:, 0], vertices[:, 2]), vertices[:, 1]])


def lengths_along(vertices, faces):
    return surface_lengths(vertices, Topology(faces))


def length(points, edges):
    return np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)


def distance_outside(vertices, radius=RADIUS_MM):
    return np.hypot(vertices[:, 0], vertices[:, 2]) - radius


def fitted(vertices, faces):
    """Edges, jets, and whether the vertices are told to stand outside."""
    edges, chosen = Topology(faces).edges, np.arange(len(vertices))
    rings = rings_of(vertices, faces, edges)
    noise = estimate_noise_sigma(vertices, rings)
    jets = fit_jets(vertices, rings, chosen, noise, noise)
    again = fit_jets(correct_decimation_bias(vertices, jets, edges, chosen), rings, chosen, noise, noise)
    return edges, jets, stood_outside(jets.offsets, again.offsets - jets.offsets)


@pytest.fixture(params=[0, 1, 2])
def sheet(request):
    flat, faces = scatter_points(POINTS, PATCH_MM, np.random.default_rng(request.param))
    return flat, faces


def decimated(seed, own_vertices, radius=RADIUS_MM):
    flat, faces = scatter_points(20 * POINTS, PATCH_MM, np.random.default_rng(seed))
    return decimate(cylinder(flat, radius=radius), faces, POINTS, own_vertices=own_vertices)


@pytest.mark.parametrize("radius", [RADIUS_MM, STEEP_MM])
@pytest.mark.parametrize("seed", range(3))
def test_lengths_through_the_vertices_of_a_decimated_mesh_are_those_of_the_surface(seed, radius, monkeypatch):
    vertices, faces = decimated(seed, own_vertices=False, radius=radius)
    assert np.median(distance_outside(vertices, radius)) > 0
    edges = Topology(faces).edges
    true = length(unrolled(vertices, radius), edges)
    found = lengths_along(vertices, faces)
    monkeypatch.setattr(lengths_module, "stood_outside", lambda *_: False)
    too_long = np.mean(lengths_along(vertices, faces) - true)
    assert abs(np.mean(found - true)) < LEFT * too_long


@pytest.mark.parametrize("seed", range(3))
def test_vertices_that_decimation_has_left_where_they_were_stay(seed):
    vertices, faces = decimated(seed, own_vertices=True)
    assert not fitted(vertices, faces)[2]


def test_vertices_on_a_surface_stay_and_those_outside_come_back(sheet):
    flat, faces = sheet
    on_it = cylinder(flat)
    edges, jets, outside = fitted(on_it, faces)
    assert not outside
    lifted = on_it - OUTSIDE * _neighbour_heights(on_it, jets.forms, edges)[:, None] * jets.normals
    edges, jets, outside = fitted(lifted, faces)
    assert outside
    back = correct_decimation_bias(lifted, jets, edges, np.arange(len(flat)))
    assert np.median(np.abs(distance_outside(back))) < BACK * np.median(distance_outside(lifted))


def test_only_the_chosen_are_moved(sheet):
    flat, faces = sheet
    vertices, chosen = cylinder(flat), np.arange(0, POINTS, 3)
    edges, jets, _ = fitted(vertices, faces)
    moved = (correct_decimation_bias(vertices, jets, edges, chosen) != vertices).any(axis=1)
    assert moved[chosen].all()
    assert moved.sum() == len(chosen)


def test_noise_that_hides_it_leaves_them_where_they_are(sheet):
    flat, faces = sheet
    on_it = cylinder(flat)
    edges, jets, _ = fitted(on_it, faces)
    out = -OUTSIDE * _neighbour_heights(on_it, jets.forms, edges)
    noise = np.random.default_rng(3).normal(scale=NOISE_MM, size=len(flat))
    assert not fitted(cylinder(flat, out + noise), faces)[2]


def test_a_plane_has_no_outside(sheet):
    flat, faces = sheet
    assert not fitted(np.column_stack([flat, np.zeros(len(flat))]), faces)[2]
    assert not stood_outside(np.zeros(3), np.zeros(3))


def test_compiled_and_plain_heights_agree(sheet):
    flat, faces = sheet
    vertices = cylinder(flat)
    edges, jets, _ = fitted(vertices, faces)
    found = _neighbour_heights(vertices, jets.forms, edges)
    np.testing.assert_allclose(_neighbour_heights.py_func(vertices, jets.forms, edges), found, rtol=PARITY, atol=PARITY)


def pleated(columns, rows, fold_deg):
    """A clean grid with a vertex row on every crease of an accordion, which its straight edges describe exactly."""
    flat = np.stack(np.meshgrid(np.linspace(0, 280, columns), np.linspace(0, 200, rows)), axis=-1).reshape(-1, 2)
    first = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    lower = np.stack([first, first + 1, first + columns], axis=1)
    upper = np.stack([first + 1, first + columns + 1, first + columns], axis=1)
    slope = np.radians(fold_deg / 2) * np.where(np.arange(columns - 1) % 2, 1.0, -1.0)
    step = 280 / (columns - 1)
    profile = np.concatenate([[[0, 0]], np.cumsum(step * np.stack([np.cos(slope), np.sin(slope)], axis=1), axis=0)])
    along, height = np.tile(profile, (rows, 1)).T
    return flat, SurfaceMesh(np.column_stack([along, flat[:, 1], height]), np.concatenate([lower, upper]))


@pytest.mark.parametrize("columns, rows, fold_deg", [(9, 9, 10), (33, 9, 30), (33, 25, 30), (2, 12, 0)])
def test_faces_that_unfold_by_themselves_are_left_as_they_are(columns, rows, fold_deg):
    flat, mesh = pleated(columns, rows, fold_deg)
    page = flatten_points(mesh)
    assert np.abs(rigid_residual(page.flat, flat)[0]).max() < PLEATED_MM


def test_vertices_without_a_face_say_nothing(sheet):
    flat, faces = sheet
    noise = np.random.default_rng(4).normal(scale=NOISE_MM, size=len(flat))
    vertices = cylinder(flat, noise)
    more = np.concatenate([vertices, np.random.default_rng(5).normal(size=(2 * POINTS, 3))])
    np.testing.assert_allclose(lengths_along(more, faces), lengths_along(vertices, faces), rtol=1e-9)

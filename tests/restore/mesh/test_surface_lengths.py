"""Lengths along known surfaces, from their vertices alone."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from oracles.exact import scatter_points
from restore.mesh import surface_lengths as module
from restore.mesh.jets import MAX_NEIGHBOURS, Jets, fit_jets, rings_of
from restore.mesh.surface_lengths import bent_lengths, estimate_noise_sigma, straight_and_along, surface_lengths
from restore.mesh.topology import Topology

PATCH_MM = (60.0, 40.0)
RADIUS_MM = 60.0
SLOPE = np.deg2rad(30.0)
CREASE_MM = 1.3  # off the middle: through no vertex
EXACT = 1e-12
ARC = 0.05  # of the chords' error may remain on a cylinder; 0.01 measured
OVER_CREASE = 0.25  # of the chords' error, rms of the edges over it; 0.17 measured: which side is which, patches guess
ADJACENT = 0.01  # rms of edges that lie on one side of it alone
SPINE = np.deg2rad(70.0)
SPINE_BEND_MM = 60.0  # radius of the pages beside it, which rise to it the steeper the nearer they are
OVER_SPINE = 0.2  # of the chords' error, median of the edges over it; 0.1 measured
PARITY = 1e-9
EVEN_BEND = 0.05  # of what the chord cuts short; the cubic is right to the fourth power of the angle, 0.042 at 69°
GRAINY_MM = 0.04  # among vertices 0.8 mm apart
SMOOTHED = 0.15  # of what the chords grow; 0.05 measured, 0.41 without
NOISE_MM = 0.02
NOISE_KNOWN = 0.36  # of it; of 100 probes a median absolute deviation is known to 12 %, this is 3σ
ROLL_MM = 15.0  # radius, of edges 3 mm long
ROLL_NOISE_MM = 0.15  # a twentieth of them
MAX_SMOOTH = 0.9  # of the vertices
LOST = 0.1  # of those beside a crease are taken for smooth
INFLATED = 0.75  # of what the chords grow; the patches take off-plane noise out but between near neighbours

SPOKES = 40  # more neighbours than a patch takes
UNEVEN_MM = 0.02  # so that no two are equally near
MOST = 0.5  # of the edges over a crease are longer than their chord
REORDERED = 1e-9  # rounding of sums in another order


@pytest.fixture(scope="module")
def patch():
    flat, faces = scatter_points(600, PATCH_MM, np.random.default_rng(0))
    edges = Topology(faces).edges
    return flat, faces, edges, length(flat, edges)


def lengths_along(vertices, faces):
    return surface_lengths(vertices, Topology(faces))


def length(points, edges):
    return np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)


def rms(values):
    return np.sqrt(np.mean(np.square(values)))


def test_on_a_flat_mesh_they_are_the_straight_distances(patch):
    flat, faces, _, true = patch
    vertices = np.column_stack([flat, np.zeros(len(flat))])
    np.testing.assert_allclose(lengths_along(vertices, faces), true, rtol=EXACT)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_on_a_cylinder_they_are_the_arcs(patch, sign):
    flat, faces, edges, true = patch
    turn = flat[:, 0] / RADIUS_MM
    vertices = np.column_stack([RADIUS_MM * np.sin(turn), flat[:, 1], sign * RADIUS_MM * np.cos(turn)])
    found = lengths_along(vertices, faces)
    assert rms(found / true - 1) < ARC * rms(length(vertices, edges) / true - 1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_even_bend_is_as_long_as_the_arc_between_two_normals(sign):
    angles = np.array([0.0, 0.2, 0.6, 1.2])
    points = RADIUS_MM * np.column_stack([np.sin(angles), np.zeros(4), np.cos(angles)])
    normals = sign * points / RADIUS_MM
    edges = np.array([[0, 1], [0, 2], [0, 3], [1, 3]])
    arcs = RADIUS_MM * np.diff(angles[edges], axis=1)[:, 0]
    found = bent_lengths(points, normals, edges)
    assert (np.abs(found / arcs - 1) < EVEN_BEND * (1 - length(points, edges) / arcs)).all()
    np.testing.assert_allclose(bent_lengths.py_func(points, normals, edges), found, atol=PARITY)


def test_over_a_fold_they_go_over_the_crease(patch):
    flat, faces, edges, true = patch
    off = flat[:, 0] - CREASE_MM
    vertices = np.column_stack([off * np.cos(SLOPE), flat[:, 1], np.abs(off) * np.sin(SLOPE)])
    found, over = lengths_along(vertices, faces) / true - 1, off[edges].prod(axis=1) < 0
    assert rms(found[over]) < OVER_CREASE * rms(length(vertices, edges)[over] / true[over] - 1)
    assert rms(found[~over]) < ADJACENT


def test_over_a_spine_they_follow_the_pages_that_rise_to_it(patch):
    flat, faces, edges, true = patch
    off = flat[:, 0] - CREASE_MM
    slope = SPINE - np.abs(off) / SPINE_BEND_MM
    along = SPINE_BEND_MM * (np.sin(SPINE) - np.sin(slope))
    rise = SPINE_BEND_MM * (np.cos(slope) - np.cos(SPINE))
    vertices = np.column_stack([np.sign(off) * along, flat[:, 1], -rise])
    found, over = lengths_along(vertices, faces) / true - 1, off[edges].prod(axis=1) < 0
    chords = length(vertices, edges) / true - 1
    assert np.median(np.abs(found[over])) < OVER_SPINE * np.median(np.abs(chords[over]))


def test_noise_does_not_inflate_them_as_it_does_the_chords(patch):
    flat, faces, edges, true = patch
    vertices = np.column_stack([flat, np.random.default_rng(1).normal(scale=NOISE_MM, size=len(flat))])
    grown, chords = (np.mean(x / true - 1) for x in (lengths_along(vertices, faces), length(vertices, edges)))
    assert abs(estimate_noise_sigma(vertices, rings_of(vertices, faces, edges)) / NOISE_MM - 1) < NOISE_KNOWN
    assert 0 < grown < INFLATED * chords
    straight = straight_and_along(vertices, Topology(faces))[0]
    assert 0 < np.mean(straight / true - 1) <= grown


def test_a_surface_without_noise_is_reported(patch):
    flat, faces, edges, _ = patch
    vertices = np.column_stack([flat, 0.5 * flat[:, 0] ** 2 / RADIUS_MM])
    assert estimate_noise_sigma(vertices, rings_of(vertices, faces, edges)) < 0.1 * NOISE_MM


def test_they_scale_with_the_surface(patch):
    flat, faces, _, _ = patch
    vertices = np.column_stack([flat, 0.2 * np.abs(flat[:, 0] - CREASE_MM) + 0.002 * flat[:, 1] ** 2])
    here = lengths_along(vertices, faces)
    np.testing.assert_allclose(lengths_along(1e3 * vertices, faces), 1e3 * here, rtol=1e-6)


def test_compiled_and_plain_python_agree(plain):
    flat, faces = scatter_points(150, PATCH_MM, np.random.default_rng(1))
    vertices = np.column_stack([flat, 0.5 * np.abs(flat[:, 0] - CREASE_MM) + 0.002 * flat[:, 1] ** 2])
    compiled = lengths_along(vertices, faces)
    assert "_over_crease" in plain(module)
    np.testing.assert_allclose(compiled, lengths_along(vertices, faces), atol=PARITY)


@pytest.fixture(scope="module")
def dense():
    flat, faces = scatter_points(4000, PATCH_MM, np.random.default_rng(0))
    edges = Topology(faces).edges
    return flat, faces, edges, length(flat, edges)


def growth(vertices, faces, edges, true):
    """Of the lengths along the surface, and of the chords."""
    return tuple(np.mean(x / true - 1) for x in (lengths_along(vertices, faces), length(vertices, edges)))


@pytest.mark.parametrize("bend", [0.0, 1.0 / RADIUS_MM], ids=["flat", "cylinder"])
def test_grainy_vertices_are_smoothed_before_lengths_are_measured(dense, bend):
    flat, faces, edges, true = dense
    noise = np.random.default_rng(1).normal(scale=NOISE_MM, size=len(flat))
    radius, turn = (1.0 / bend + noise, flat[:, 0] * bend) if bend else (noise, None)
    vertices = np.column_stack(
        [flat, radius] if turn is None else [radius * np.sin(turn), flat[:, 1], radius * np.cos(turn)]
    )
    found, chords = growth(vertices, faces, edges, true)
    assert abs(found) < SMOOTHED * chords


def test_what_lies_next_to_a_crease_is_not_smoothed(patch):
    flat, _, edges, _ = patch
    off = flat[:, 0] - CREASE_MM
    normals = np.column_stack([-np.sign(off) * np.sin(SLOPE), np.zeros(len(off)), np.full(len(off), np.cos(SLOPE))])
    over = off[edges].prod(axis=1) < 0
    vertices = np.column_stack([off * np.cos(SLOPE), flat[:, 1], np.abs(off) * np.sin(SLOPE)])
    jets = Jets(normals, np.zeros(len(off)), np.zeros((len(off), 3, 3)))
    for steepest in (module.CREASE, np.pi):  # by its turn, and as the way goes over it
        smooth = module._away_from_creases(vertices, jets, edges, steepest)
        np.testing.assert_array_equal(smooth, np.setdiff1d(np.arange(len(flat)), edges[over]))
    assert len(smooth) < len(flat)


def patches(vertices, faces, edges):
    rings = rings_of(vertices, faces, edges)
    noise = estimate_noise_sigma(vertices, rings)
    return fit_jets(vertices, rings, np.arange(len(vertices)), noise, noise)


def steep_roll(noise_mm):
    """A roll whose edges turn by more than a crease in the mean, and what its patches make of it."""
    flat, faces = scatter_points(300, PATCH_MM, np.random.default_rng(0))
    noise = np.random.default_rng(1).normal(scale=noise_mm, size=len(flat))
    turn = flat[:, 0] / ROLL_MM * (1.0 + 0.3 * flat[:, 0] / PATCH_MM[0])
    vertices = np.column_stack([(ROLL_MM + noise) * np.sin(turn), flat[:, 1], (ROLL_MM + noise) * np.cos(turn)])
    edges = Topology(faces).edges
    return vertices, edges, patches(vertices, faces, edges)


def test_steep_bends_are_not_creases_where_noise_is_worse_than_what_patches_leave_out():
    vertices, edges, jets = steep_roll(ROLL_NOISE_MM)
    steepest = module._steepest_bend(jets, edges)
    turned = module._turns(jets.normals, edges)
    assert np.median(turned) > module.CREASE
    assert steepest > np.quantile(turned, 0.99)
    assert len(module._away_from_creases(vertices, jets, edges, steepest)) > MAX_SMOOTH * len(vertices)


def test_steep_bends_without_noise_are_not_put_on_patches_that_cut_them_short():
    _, edges, jets = steep_roll(0.0)
    assert module._steepest_bend(jets, edges) == module.CREASE


def test_creases_stand_out_among_noise(patch):
    flat, faces, edges, _ = patch
    off = flat[:, 0] - CREASE_MM
    noise = np.random.default_rng(2).normal(scale=NOISE_MM, size=len(flat))
    vertices = np.column_stack([off * np.cos(SLOPE), flat[:, 1], np.abs(off) * np.sin(SLOPE) + noise])
    jets = patches(vertices, faces, edges)
    smooth = module._away_from_creases(vertices, jets, edges, module._steepest_bend(jets, edges))
    ends = np.unique(edges[off[edges].prod(axis=1) < 0])
    assert np.isin(ends, smooth).mean() < LOST
    assert np.isin(np.setdiff1d(np.arange(len(flat)), ends), smooth).mean() > MAX_SMOOTH


@pytest.mark.parametrize("seed", range(3))
def test_lengths_at_a_vertex_with_many_neighbours_do_not_depend_on_their_numbers(seed):
    random = np.random.default_rng(seed)
    angles, radii = np.linspace(0.0, 2.0 * np.pi, SPOKES, endpoint=False), np.array([[4.0], [7.0], [10.0]])
    rings = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=-1).reshape(-1, 2)
    flat = np.concatenate([[[0.0, 0.0]], rings + random.normal(0.0, UNEVEN_MM, rings.shape)])
    faces = Delaunay(flat).simplices
    height = 0.02 * flat[:, 0] ** 2 + random.normal(0.0, NOISE_MM, len(flat))
    vertices, order = np.column_stack([flat, height]), random.permutation(len(flat))
    edges, renumbered = Topology(faces).edges, Topology(np.argsort(order)[faces]).edges
    assert np.bincount(edges.ravel()).max() > MAX_NEIGHBOURS
    there = lengths_along(vertices[order], np.argsort(order)[faces])
    found = dict(zip(map(tuple, np.sort(order[renumbered], axis=1).tolist()), there, strict=True))
    here = lengths_along(vertices, faces)
    np.testing.assert_allclose([found[tuple(edge)] for edge in edges.tolist()], here, rtol=REORDERED)


@pytest.mark.parametrize("fold_deg", [60.0, 100.0, 130.0])
def test_a_way_is_as_long_in_the_other_direction(patch, fold_deg):
    flat, faces, edges, _ = patch
    off = flat[:, 0] - CREASE_MM
    slope = np.deg2rad(fold_deg / 2)
    vertices = np.column_stack([np.cos(slope) * off, flat[:, 1], -np.sin(slope) * np.abs(off) + 0.01 * off**2])
    across = off[edges[:, 0]] * off[edges[:, 1]] < 0.0
    there = lengths_along(vertices, faces)
    assert (there[across] > length(vertices, edges)[across]).mean() > MOST
    backwards = Topology(faces)
    vars(backwards)["sides"] = backwards.sides._replace(edges=edges[:, ::-1])
    np.testing.assert_allclose(surface_lengths(vertices, backwards), there, rtol=REORDERED)

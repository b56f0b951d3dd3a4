"""Points and lengths of the prepared sheet against planes, roofs and cylinders whose lengths are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from restore.camera.rays import MAX_SLOPE
from restore.mesh.triangulate import lattice
from restore.range_image.facets.facet_model import Facets
from restore.range_image.facets.sheet import _path_lengths, depth_distance, make_sheet

EXACT = 1e-9  # mm: rounding at a metre's distance
# The path over a cylinder runs on tangents of half a sample either side, by δ²/3 longer than the arc for facets that
# turn by 2δ; between 0.47 mm samples of a 60 mm curl, seen under 46° at most, that is 1.1e-5.
TANGENT_ERROR = 1.2e-5
MIN_CHORD_LOSS_MM = (
    0.05  # mm: what a chord over a 90° crease loses, at the least that the nodes here can lie from the ridge
)
# A path may leave a sample's cell before it crosses the ridge, and run on in the wrong wall for a bit of a sample.
SLANTING_ERROR_MM = 0.02  # mm
MIDWAY_ERROR_MM = 2e-3  # mm: a path just midway between two samples may run in the noisy facet of either
ARC_ERROR_MM = 1e-5  # mm: chords from sample to sample against twenty times as many along a path bent by the lens
SPINE_REACH_MM = 25.0
SPINE_ERROR = 0.015  # of the step: towards the spine a side turns by more than in the step before
TIMES_SHORT = 3.0  # over that is what sides lose that do not go on turning
ROUNDING = 1e-6  # standard deviations
SINGLE_MM = 4e-4  # inverse depth in single precision, at 0.9 m

nodes = st.tuples(st.floats(5.0, 150.0), st.floats(5.0, 190.0))
whole_nodes = st.tuples(st.integers(5, 150), st.integers(5, 190))


def roof(camera, walls):
    """A sheet with the facets of two walls, each on its own side of the ridge."""
    return camera.sheet(np.where((walls[0] < walls[1])[..., None], *map(camera.facets, walls)))


@pytest.fixture(scope="session")
def tilted(camera):
    return camera.sheet(camera.facets(camera.plane((0.4, -0.3, 1.0))))


@settings(deadline=None)
@given(st.lists(nodes, min_size=2, max_size=8))
def test_on_a_tilted_plane_points_and_lengths_are_exact_between_samples(tilted, places):
    places = np.array(places)
    points = tilted.points(places)
    normal = np.array([0.4, -0.3, 1.0])
    np.testing.assert_allclose(points @ normal, -921.5 * normal[2], atol=EXACT)
    back = np.stack(tilted.rays.grid(points), axis=1)
    np.testing.assert_allclose(back, places, atol=EXACT)
    edges = np.stack([np.arange(len(places)), np.roll(np.arange(len(places)), 1)], axis=1)
    straight = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    np.testing.assert_allclose(tilted.lengths(places, edges), straight, atol=EXACT)


def over_the_ridge(camera, walls, start, end):
    """The length over the ridge of the path that is straight in the picture, and of the chord under it."""

    def at(wall, place):
        return wall[0, 0] + (wall[0, 1] - wall[0, 0]) * place[1] + (wall[1, 0] - wall[0, 0]) * place[0]

    gap = [at(walls[0], place) - at(walls[1], place) for place in (start, end)]
    share = gap[0] / (gap[0] - gap[1])
    assert 0.0 <= share <= 1.0
    ridge = start + share * (end - start)
    a, m, b = (camera.rays.points(*place, min(at(wall, place) for wall in walls)) for place in (start, ridge, end))
    return np.linalg.norm(a - m) + np.linalg.norm(m - b), np.linalg.norm(a - b)


@pytest.mark.parametrize("column", [100.0, 100.01, 100.3, 100.5, 100.99])
@pytest.mark.parametrize("fold_deg", [20.0, 90.0, 132.0])
def test_across_a_ridge_between_samples_the_length_is_exact(camera, fold_deg, column):
    walls = camera.walls(fold_deg, 0.0, column)
    folded = roof(camera, walls)
    ends = np.array([[80, 96], [80, 104], [80, 98], [80, 103], [80, 100], [80, 101]], float)
    edges = np.array([[0, 1], [2, 3], [4, 5]])
    found = folded.lengths(ends, edges)
    exact, chords = np.transpose([over_the_ridge(camera, walls, ends[a], ends[b]) for a, b in edges])
    np.testing.assert_allclose(found, exact, atol=EXACT)
    if fold_deg >= 90:
        assert (exact[:2] - chords[:2] > MIN_CHORD_LOSS_MM).all()


@pytest.mark.parametrize("column", [100.01, 100.3, 100.5, 100.99])
@pytest.mark.parametrize("slope_deg", [50.0, 66.0])
def test_walls_go_on_turning_up_to_the_spine_between_two_samples(camera, slope_deg, column):
    facets, along = camera.book(slope_deg, SPINE_REACH_MM, column)
    middle, last = (camera.rows - 1) / 2, int(np.flatnonzero(along < 0)[-1])
    ends = np.array([[middle, last], [middle, last + 1]])
    found = camera.sheet(facets).lengths(ends, np.array([[0, 1]]))[0]
    exact = along[last + 1] - along[last]
    assert found == pytest.approx(exact, rel=SPINE_ERROR)
    straight = camera.sheet(np.where(along[:, None] < 0, facets[:, [last]], facets[:, [last + 1]]))
    straight.planes[..., 0] = facets[..., 0]
    assert exact - straight.lengths(ends, np.array([[0, 1]]))[0] > TIMES_SHORT * abs(found - exact)


@settings(deadline=None)
@given(whole_nodes, whole_nodes, st.sampled_from([0.0, 30.0, 65.0]), st.sampled_from([90.0, 132.0]))
def test_slanting_paths_over_slanting_ridges_are_nearly_exact(camera, start, end, angle_deg, fold_deg):
    walls = camera.walls(fold_deg, angle_deg, 100.3)
    folded = roof(camera, walls)
    ends = np.array([start, end], float)
    side = [walls[0][place] < walls[1][place] for place in (start, end)]
    found = folded.lengths(ends, np.array([[0, 1]]))[0]
    if side[0] == side[1]:
        points = folded.points(ends)
        assert found == pytest.approx(np.linalg.norm(points[0] - points[1]), abs=EXACT)
    else:
        assert found == pytest.approx(over_the_ridge(camera, walls, *ends)[0], abs=SLANTING_ERROR_MM)


@pytest.mark.parametrize("hollow", [False, True], ids=["convex", "hollow"])
@pytest.mark.parametrize("radius", [60.0, 100.0])
def test_round_a_cylinder_the_length_is_nearly_the_arc(camera, radius, hollow):
    depth = camera.cylinder(radius, hollow=hollow)
    curl = camera.sheet(camera.facets(depth))
    middle = (camera.rows - 1) / 2  # level with the scanner: there the path is a circle round the axis
    places = np.array([[middle, column] for column in (10.0, 14.0, 50.0, 100.0, 101.0, 140.0)])
    edges = np.stack([np.arange(5), np.arange(1, 6)], axis=1)
    found = curl.lengths(places, edges)
    points = camera.rays.points(places[:, 0], places[:, 1], depth[0, places[:, 1].astype(int)])
    axis = -(921.5 - radius if hollow else 921.5 + radius)
    angle = np.arctan2(points[:, 0], (points[:, 2] - axis) * (-1 if hollow else 1))
    np.testing.assert_allclose(found, radius * np.abs(np.diff(angle)), rtol=TANGENT_ERROR)


@given(st.lists(whole_nodes, min_size=3, max_size=3), st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=20)
def test_a_length_does_not_depend_on_the_direction_even_where_facets_are_noisy(camera, places, seed):
    planes = camera.facets(camera.plane())
    random = np.random.default_rng(seed)
    planes = planes + random.normal(0, camera.noise, planes.shape) * [0.3, 0.1, 0.1]
    rough = camera.sheet(planes)
    edges = np.array([[0, 1], [1, 2], [2, 0]])
    there, back = (rough.lengths(np.array(places, float), way) for way in (edges, edges[:, ::-1].copy()))
    np.testing.assert_allclose(there, back, atol=MIDWAY_ERROR_MM)


def test_compiled_and_plain_python_measure_the_same(camera):
    walls = camera.walls(90.0, 30.0, 100.3)
    folded = roof(camera, walls)
    ends = np.random.default_rng(1).uniform(10, 150, (12, 2))
    edges = np.stack([np.arange(11), np.arange(1, 12)], axis=1)
    scatter = np.random.default_rng(2).uniform(0.0, folded.noise**2, folded.scatter.shape)
    operands = folded.planes, scatter, ends, edges, camera.rays.lens, folded.noise
    compiled, plain = np.full((2, len(edges)), np.nan)
    _path_lengths(*operands, compiled)
    _path_lengths.py_func(*operands, plain)
    np.testing.assert_allclose(compiled, plain, atol=EXACT)


@pytest.fixture(scope="session")
def prepared(camera):
    """A plane known on a disc with a hole in it, as the facets would tell it; noise is wilder outside."""
    rows, cols = camera.indices
    inside = np.hypot(rows - 80, cols - 100) < 60
    hole = np.hypot(rows - 70, cols - 90) < 6
    exact = camera.facets(camera.plane((0.4, -0.3, 1.0)))
    seen = inside & ~hole
    value = np.where(seen, exact[..., 0], np.nan)
    slope = np.where(seen[..., None], exact[..., 1:], np.nan)
    facets = Facets(value, slope, np.zeros(camera.shape, bool), camera.noise)
    pixels = np.dstack([2.0 * cols + 1.0, 3.0 * rows])
    return make_sheet(camera.rays, facets, seen, inside, pixels, camera.shot(value)), exact, seen, inside


def test_the_nearest_facet_is_extrapolated_over_holes_and_past_the_outline(prepared, camera):
    made, exact, seen, inside = prepared
    np.testing.assert_allclose(made.planes, exact, atol=ROUNDING * camera.noise)
    np.testing.assert_array_equal(made.inside, inside)
    np.testing.assert_array_equal(made.measured, seen)
    assert made.noise == camera.noise
    assert np.isfinite(made.points(np.array([[0.0, 0.0], [159.0, 199.0], [70.0, 90.0], [20.5, 100.25]]))).all()


@pytest.mark.parametrize("times", [1.5, 200.0])
def test_a_facet_too_steep_to_be_seen_is_replaced_by_the_nearest_one(camera, times):
    exact = camera.facets(camera.plane((0.4, -0.3, 1.0)))
    slope = exact[..., 1:].copy()
    slope[80, 100, 0] = times * MAX_SLOPE * camera.rays.dx * exact[80, 100, 0]
    everywhere = np.ones(camera.shape, bool)
    facets = Facets(exact[..., 0], slope, ~everywhere, camera.noise)
    pixels = np.dstack(camera.indices[::-1])
    made = make_sheet(camera.rays, facets, everywhere, everywhere, pixels, camera.shot(exact[..., 0]))
    np.testing.assert_allclose(made.planes, exact, atol=ROUNDING * camera.noise)


def test_texture_positions_are_interpolated(prepared):
    made, _, _, _ = prepared
    np.testing.assert_allclose(made.texcoords(np.array([[80.25, 100.5], [81.0, 99.0]])), [[202.0, 240.75], [199, 243]])


def test_lengths_are_computed_with_lens_distortion(camera):
    wide = replace(camera.rays, x0=-0.3, y0=0.22, dx=0.6 / camera.cols, dy=-0.44 / camera.rows, distortion=(-0.1, 0.05))
    level = camera.plane()
    bent = replace(camera.sheet(camera.facets(level)), rays=wide)
    places = np.array([[3.0, 4.0], [150.5, 190.25]])
    fine = np.linspace(*places, 4001)
    points = wide.points(fine[:, 0], fine[:, 1], np.full(len(fine), level[0, 0]))
    wanted = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    pinhole = replace(bent, rays=replace(wide, distortion=(0.0, 0.0)))
    edge = np.array([[0, 1]])
    assert bent.lengths(places, edge)[0] == pytest.approx(wanted, abs=ARC_ERROR_MM)
    assert abs(pinhole.lengths(places, edge)[0] - wanted) > 1.0


def test_the_depth_distance_of_a_mesh_on_a_plane_is_zero(camera):
    sheet = camera.sheet(camera.facets(camera.plane((0.3, 0.1, 1.0))))
    nodes, faces = lattice(sheet.inside, 16)
    distance = depth_distance(sheet, nodes, faces)
    assert max(distance.values()) < SINGLE_MM


def test_the_depth_distance_of_a_chord_is_its_sag(camera):
    """Two triangles over a curl: the middle is off by the sag of a chord of 94 mm."""
    sheet = camera.sheet(camera.facets(camera.cylinder(100.0)))
    nodes = np.array([[0, 0], [0, 199], [159, 0], [159, 199]], float)
    points = sheet.points(nodes)
    sag = -921.5 - points[0, 2]
    distance = depth_distance(sheet, nodes, np.array([[0, 2, 1], [1, 2, 3]]))
    assert distance["max_mm"] == pytest.approx(sag, rel=1e-3)
    assert distance["mean_mm"] == pytest.approx(2 * sag / 3, rel=0.1)  # of a parabola
    assert 0 < distance["sd_mm"] < sag

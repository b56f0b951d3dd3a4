"""Meshes of one shot are restored to their range grid; other meshes are rejected."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from restore.range_image.organise import organise
from restore.scan import RangeScan, SurfaceMesh
from restore.vivid import FOCAL_PX

CENTRE = np.array([319.5, 239.5])
EXACT_PX = 1e-6  # a lattice fitted to exact samples
DECIMALS = 2  # the fewest that an export has
ROUNDED_PX = 0.1  # 0.01 mm at 600 mm is 0.03 pixel of the TELE lens; some samples, not their mean, carry it


def shot(rows=40, cols=50, *, lens="MIDDLE", thinned=1, origin=(250, 200), distance=700.0, missing=0.1, seed=0):
    """A crumpled sheet as one shot sees it, with a hole and `missing` of the samples lost."""
    rng = np.random.default_rng(seed)
    col, row = np.meshgrid(np.arange(cols), np.arange(rows))
    pixels = np.array(origin) + (np.stack([col, row], axis=-1) + 0.5) * thinned - 0.5
    depth = distance + 15 * np.sin(0.1 * col) + 9 * np.cos(0.17 * row) + rng.normal(0, 0.05, (rows, cols))
    rays = (pixels - CENTRE) / FOCAL_PX[lens]
    points = np.stack([rays[..., 0] * depth, -rays[..., 1] * depth, -depth], axis=-1)
    points[rng.random((rows, cols)) < missing] = np.nan
    points[rows // 3 : rows // 3 + 6, cols // 2 : cols // 2 + 8] = np.nan
    return RangeScan(points, np.zeros((480, 640, 3), np.uint8), pixels)


def joined(scan):
    """Two triangles in every cell with four measured corners."""
    seen = scan.measured
    number = np.cumsum(seen.ravel()).reshape(seen.shape) - 1
    a, b, c, d = (x[seen[:-1, :-1] & seen[1:, :-1] & seen[:-1, 1:] & seen[1:, 1:]] for x in
                  (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))  # fmt: skip
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return SurfaceMesh(scan.points[seen], faces, scan.texture_xy[seen], scan.texture, {"file": "a"})


def bare(mesh, **changes):
    return replace(mesh, texcoords=None, **changes)


def assert_same(back, scan, tolerance_px):
    np.testing.assert_array_equal(back.points, scan.points)
    np.testing.assert_allclose(back.texture_xy, scan.texture_xy, atol=tolerance_px, rtol=0)


@pytest.mark.parametrize("flipped", [0, 1], ids=["left for right", "upside down"])
def test_a_shot_and_its_mirrored_picture_are_brought_together_with_a_warning(flipped):
    mesh = joined(shot())
    size = np.array([639.0, 479.0])
    texcoords = mesh.texcoords.copy()
    texcoords[:, flipped] = size[flipped] - texcoords[:, flipped]
    back = organise(replace(mesh, texcoords=texcoords))
    mirrored = organise(replace(mesh, vertices=mesh.vertices * [-1, 1, 1], texcoords=texcoords))
    np.testing.assert_array_equal(back.points, mirrored.points)
    np.testing.assert_array_equal(back.texture_xy, mirrored.texture_xy)
    assert "mirror images of each other" in back.findings[0].text
    assert mirrored.findings == ()


def test_samples_are_restored_to_their_cells():
    scan = shot()
    back = organise(joined(scan))
    assert_same(back, scan, EXACT_PX)
    assert back.texture is scan.texture
    assert back.provenance == {"file": "a", "lens": "MIDDLE"}


@pytest.mark.parametrize("lens", FOCAL_PX)
@pytest.mark.parametrize("thinned", [1, 2, 3, 4])
def test_the_lens_and_the_texture_positions_follow_from_the_pitch(lens, thinned):
    scan = shot(lens=lens, thinned=thinned)
    back = organise(bare(joined(scan)))
    assert back.provenance["lens"] == lens
    assert_same(back, scan, EXACT_PX)


def test_texture_positions_scale_with_a_larger_picture():
    scan = shot()
    back = organise(bare(joined(scan), texture=np.zeros((960, 1280, 3), np.uint8)))
    np.testing.assert_allclose(back.texture_xy, 2 * scan.texture_xy + 0.5, atol=EXACT_PX)


@pytest.mark.parametrize("picture", [(480, 480, 3), (640, 480, 3)])
def test_a_picture_of_another_view_is_left_out(picture):
    back = organise(bare(joined(shot()), texture=np.zeros(picture, np.uint8)))
    assert back.texture is None
    assert back.texture_xy[2, 3].tolist() == [3, 2]


def test_a_picture_is_left_out_when_no_lens_fits():
    mesh = joined(shot())
    back = organise(bare(mesh, vertices=mesh.vertices * [0.8, 0.8, 1]))
    assert back.texture is None
    assert "lens" not in back.provenance


@settings(deadline=None, max_examples=30)
@given(
    rows=st.integers(8, 60),
    cols=st.integers(8, 60),
    lens=st.sampled_from(sorted(FOCAL_PX)),
    missing=st.floats(0, 0.15),
    origin=st.tuples(st.integers(0, 580), st.integers(0, 420)),
    seed=st.integers(0, 99),
)
def test_any_part_of_a_shot_is_organised(rows, cols, lens, missing, origin, seed):
    scan = shot(rows, cols, lens=lens, missing=missing, origin=origin, seed=seed)
    seen = np.argwhere(scan.measured)
    top, left = seen.min(axis=0)
    bottom, right = seen.max(axis=0) + 1
    box = np.s_[top:bottom, left:right]
    back = organise(bare(joined(scan)))
    if min(bottom - top, right - left) >= 8 and scan.measured.mean() > 0.75:
        assert_same(back, RangeScan(scan.points[box], None, scan.texture_xy[box]), EXACT_PX)
    elif back is not None:  # hardly more than its hole
        assert set(map(tuple, back.points[back.measured])) == set(map(tuple, scan.points[scan.measured]))


@pytest.mark.parametrize("lens", FOCAL_PX)
def test_vertices_rounded_to_two_decimals_are_organised(lens):
    scan = shot(lens=lens, distance=600.0)
    rounded = RangeScan(np.round(scan.points, DECIMALS), scan.texture, scan.texture_xy)
    assert_same(organise(bare(joined(rounded))), rounded, ROUNDED_PX)


def test_the_order_of_the_vertices_does_not_matter():
    scan, rng = shot(), np.random.default_rng(1)
    mesh = joined(scan)
    order = rng.permutation(len(mesh.vertices))
    place = np.argsort(order)
    shuffled = replace(mesh, vertices=mesh.vertices[order], texcoords=mesh.texcoords[order], faces=place[mesh.faces])
    assert_same(organise(shuffled), scan, EXACT_PX)


def test_vertices_written_once_for_each_triangle_are_one_sample():
    scan = shot(missing=0)
    mesh = joined(scan)
    soup = SurfaceMesh(
        mesh.vertices[mesh.faces].reshape(-1, 3), np.arange(mesh.faces.size).reshape(-1, 3), None, scan.texture
    )
    assert_same(organise(soup), scan, EXACT_PX)


def test_texture_coordinates_are_extrapolated_over_holes():
    scan = shot()
    mesh = joined(scan)
    wavy = mesh.texcoords + 0.3 * np.sin(mesh.texcoords[:, ::-1] / 9)
    back = organise(replace(mesh, texcoords=wavy))
    np.testing.assert_array_equal(back.texture_xy[back.measured], wavy)
    assert np.abs(back.texture_xy - scan.texture_xy).max() < 0.5


def test_colours_become_a_picture_of_the_grid_without_gaps():
    scan = shot()
    mesh = bare(joined(scan), texture=None)
    colours = np.random.default_rng(2).integers(1, 256, (len(mesh.vertices), 3), dtype=np.uint8)
    back = organise(mesh, colours=colours)
    np.testing.assert_array_equal(back.texture[back.measured], colours)
    assert (back.texture > 0).all()
    assert back.texture_xy[4, 7].tolist() == [7, 4]


def turned(axis, degrees):
    """Turn points about their own middle. A turn about the lens leaves every line of sight a line of sight."""
    turn = Rotation.from_euler(axis, degrees, degrees=True)
    return lambda points: turn.apply(points - points.mean(axis=0)) + points.mean(axis=0)


OTHER = {
    "moved aside": lambda points: points + [60, 0, 0],
    "moved near": lambda points: points + [0, 0, 250],
    "turned about x": turned("x", 5),
    "turned about y": turned("y", 5),
    "turned about z": turned("z", 1),
    "behind the scanner": lambda points: points * [1, 1, -1],
    "through the lens": lambda points: points - [0, 0, points[:, 2].mean()],
    "noisy": lambda points: points + np.random.default_rng(3).normal(0, 0.2, points.shape),
    "flat in one point": lambda points: np.ones_like(points) * [0, 0, -700],
    "in one line": lambda points: points * [1, 0, 1],
}


@pytest.mark.parametrize("change", OTHER)
def test_a_changed_mesh_is_not_organised(change):
    mesh = joined(shot(80, 100))
    assert organise(bare(mesh)) is not None
    assert organise(bare(mesh, vertices=OTHER[change](mesh.vertices))) is None


@pytest.mark.parametrize("kept", [0.02, 0.1, 0.3, 0.5])
def test_a_decimated_mesh_is_not_organised(kept):
    """A decimation keeps some samples at their places, on the lattice still, and joins distant ones."""
    from scipy.spatial import Delaunay

    mesh = joined(shot(80, 100))
    some = np.random.default_rng(4).random(len(mesh.vertices)) < kept
    flat = mesh.texcoords[some]
    assert (
        organise(SurfaceMesh(mesh.vertices[some], Delaunay(flat).simplices.astype(np.int64), flat, mesh.texture))
        is None
    )


def test_two_merged_shots_are_not_organised():
    mesh = joined(shot())
    count = len(mesh.vertices)
    both = np.concatenate([mesh.vertices, mesh.vertices + [0.1, 0.13, -0.4]])
    assert organise(SurfaceMesh(both, np.concatenate([mesh.faces, mesh.faces + count]))) is None


def test_a_mesh_with_faces_between_distant_samples_is_not_organised():
    mesh = joined(shot())
    rng = np.random.default_rng(5)
    assert organise(replace(mesh, faces=rng.integers(0, len(mesh.vertices), mesh.faces.shape))) is None


@pytest.mark.parametrize(
    "change",
    [lambda xy: (xy + 9 * np.sin(xy / 3)) * [-1, 1], lambda xy: xy + 9 * np.sin(xy / 3), lambda xy: xy * 0],
)
def test_a_texture_that_is_not_the_cameras_view_is_not_organised(change):
    mesh = joined(shot())
    assert organise(replace(mesh, texcoords=change(mesh.texcoords))) is None


@pytest.mark.parametrize("count", [0, 1, 3, 20])
def test_a_few_vertices_are_not_organised(count):
    points = np.random.default_rng(6).normal(0, 1, (count, 3)) - [0, 0, 700]
    assert organise(SurfaceMesh(points, np.empty((0, 3), np.int64))) is None


@settings(deadline=None, max_examples=50)
@given(seed=st.integers(0, 10**6), count=st.integers(16, 400), spread=st.sampled_from([1e-9, 1.0, 300.0]))
def test_a_random_point_cloud_is_not_organised(seed, count, spread):
    rng = np.random.default_rng(seed)
    points = rng.normal(0, spread, (count, 3)) - [0, 0, 700]
    faces = rng.integers(0, count, (2 * count, 3))
    assert organise(SurfaceMesh(points, faces)) is None

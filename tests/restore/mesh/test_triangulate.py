"""A lattice covers its mask evenly and once; a raw mesh joins neighbouring samples only."""

import numpy as np
import pytest
from scipy.ndimage import binary_erosion, distance_transform_edt

from restore.mesh.adjacency import components, sides_of
from restore.mesh.raster import rasterise
from restore.mesh.triangulate import MIN_HEIGHT, compact, lattice, triangulate
from restore.prepared.description import connected_pieces

FINE = 4  # pixels a sample, to see between them
# Samples at the outline: it passes half a sample beyond the outermost of them, and cuts between the lattice's nodes.
MAX_UNCOVERED = 1.0
MAX_OUTSIDE = 1.0
AREA = 0.01  # of the mask's: a border that stands out here and back there
ROUGH_MASKS = 50  # more than half of them have a triangle that hangs by a corner, if none is left out
MAX_OVERLAP = 0.002  # of the area: pixels on the border of the fine picture


def shapes(camera):
    rows, cols = camera.indices
    across, along = camera.about_ridge(25.0, 99.5)
    return {
        "disc": np.hypot(rows - 80, cols - 100) < 60,
        "upright": (np.abs(rows - 80.2) < 50) & (np.abs(cols - 100.3) < 70),
        "turned": (np.abs(across) < 70) & (np.abs(along) < 45),
        "holed": (np.hypot(rows - 80, cols - 100) < 60) & (np.hypot(rows - 70, cols - 90) > 15),
    }


def signed_areas(nodes, faces):
    """(m,) in samples, counter-clockwise positive for one who sees rows run downwards."""
    (ar, ac), (br, bc), (cr, cc) = (nodes[faces[:, k]].T for k in range(3))
    return -((bc - ac) * (cr - ar) - (br - ar) * (cc - ac)) / 2


def painted(nodes, faces, shape):
    """The triangles' shadow in a picture FINE times as fine, one sample wider on every side; samples sit at FINE·k."""
    corners = np.ascontiguousarray(nodes[:, ::-1] + 1.0) * FINE
    picture = rasterise(corners, faces, np.ones((len(nodes), 1)), *(FINE * (extent + 2) for extent in shape))
    return np.isfinite(picture[..., 0])


@pytest.fixture(params=["disc", "upright", "turned", "holed"])
def mask(request, camera):
    return shapes(camera)[request.param]


@pytest.mark.parametrize("stride", [2, 4])
def test_a_lattice_covers_its_mask_to_the_outline_and_not_further(mask, stride):
    nodes, faces = lattice(mask, stride)
    shadow = painted(nodes, faces, mask.shape)
    samples = shadow[FINE:-FINE:FINE, FINE:-FINE:FINE]
    assert distance_transform_edt(mask)[mask & ~samples].max(initial=0.0) <= MAX_UNCOVERED
    away = distance_transform_edt(~np.pad(mask, 1).repeat(FINE, 0).repeat(FINE, 1)) / FINE
    assert away[: shadow.shape[0], : shadow.shape[1]][shadow].max() <= MAX_OUTSIDE + 1 / FINE
    assert signed_areas(nodes, faces).sum() == pytest.approx(mask.sum(), rel=AREA)


@pytest.mark.parametrize("stride", [2, 4])
def test_triangles_of_a_lattice_are_counter_clockwise_and_do_not_overlap(mask, stride):
    nodes, faces = lattice(mask, stride)
    areas = signed_areas(nodes, faces)
    assert areas.min() > 0
    shadow = painted(nodes + [1e-3, 2e-3], faces, mask.shape)  # off the pixel centres, which an edge would count twice
    assert areas.sum() == pytest.approx(shadow.sum() / FINE**2, rel=MAX_OVERLAP)


def test_a_lattice_has_no_thin_triangles_and_no_unused_nodes(mask):
    nodes, faces = lattice(mask, 4)
    corners = nodes[faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    assert (2 * signed_areas(nodes, faces) / longest).min() > MIN_HEIGHT * 4
    np.testing.assert_array_equal(np.unique(faces), np.arange(len(nodes)))


def test_interior_nodes_are_one_stride_apart_with_alternating_diagonals(mask):
    nodes, faces = lattice(mask, 4)
    rows, cols = np.nonzero(binary_erosion(mask, iterations=5))
    expected = {(r, c) for r, c in zip(rows.tolist(), cols.tolist(), strict=True) if r % 4 == 0 and c % 4 == 0}
    assert expected <= {tuple(node) for node in nodes.tolist()}
    steps = (nodes[faces[:, [1, 2, 0]]] - nodes[faces]).reshape(-1, 2)
    falling, rising = ((np.abs(steps - diagonal) < 1e-9).all(axis=1).sum() for diagonal in ([4.0, 4.0], [4.0, -4.0]))
    assert abs(int(falling) - int(rising)) < 0.1 * (falling + rising)


def test_no_triangle_of_a_lattice_hangs_by_a_corner():
    rng, row, col = np.random.default_rng(3), *np.indices((60, 60))
    for _ in range(ROUGH_MASKS):
        turn, lean = rng.uniform(0, np.pi), rng.uniform(-0.4, 0.4)
        side = (row - 30) * np.sin(turn) + (col - 30) * np.cos(turn)
        along = (col - 30) * np.sin(turn) - (row - 30) * np.cos(turn)
        mask = np.abs(side + lean * np.abs(along)) + 1.5 * np.sin(along / rng.uniform(1, 4)) < rng.uniform(10, 22)
        _, faces = lattice(mask, 4)
        sides = sides_of(faces)
        shared = sides.first[:-1][np.diff(sides.first) == 2]
        by_edges = components(np.stack([sides.at[shared], sides.at[shared + 1]], axis=1) // 3, len(faces))
        assert by_edges.max() + 1 == connected_pieces(faces)


def test_scraps_next_to_a_sheet_are_left_out_and_a_large_part_is_not():
    mask = np.zeros((130, 160), bool)
    mask[10:120, 10:100] = True
    mask[10:120, 114:136] = True
    nodes, faces = lattice(mask, 4)
    mask[40:44, 150:154] = True
    with_scrap = lattice(mask, 4)
    np.testing.assert_array_equal(with_scrap[0], nodes)
    np.testing.assert_array_equal(with_scrap[1], faces)
    assert connected_pieces(faces) == 2


def test_a_mask_to_the_edges_of_the_grid_is_covered_to_its_last_sample():
    mask = np.ones((50, 61), bool)
    nodes, faces = lattice(mask, 4)
    assert painted(nodes, faces, mask.shape)[FINE:-FINE:FINE, FINE:-FINE:FINE].all()


def test_a_raw_mesh_joins_neighbouring_samples_and_bridges_no_gap(camera):
    depth = camera.cylinder(100.0)
    gaps = np.random.default_rng(0).random(camera.shape) < 0.1
    gaps[:, 70] = True
    depth[gaps] = np.nan
    scan = camera.shot(depth)
    mesh = triangulate(scan)
    rows, cols = camera.rays.grid(mesh.vertices)
    nodes = np.stack([rows, cols], axis=1)
    np.testing.assert_allclose(nodes, nodes.round(), atol=1e-6)
    np.testing.assert_allclose(mesh.texcoords, nodes[:, ::-1], atol=1e-6)
    assert np.abs(nodes[mesh.faces] - nodes[np.roll(mesh.faces, 1, axis=1)]).max() < 1.5
    assert signed_areas(nodes, mesh.faces).min() > 0
    seen = ~gaps
    whole = seen[:-1, :-1] & seen[1:, :-1] & seen[:-1, 1:] & seen[1:, 1:]
    three = seen[:-1, :-1].astype(int) + seen[1:, :-1] + seen[:-1, 1:] + seen[1:, 1:] == 3
    assert 2 * whole.sum() <= len(mesh.faces) <= 2 * whole.sum() + three.sum()


def test_compact_drops_unused_values():
    values, faces = compact(np.array([10.0, 11.0, 12.0, 13.0, 14.0]), np.array([[4, 1, 3], [1, 4, 4]]))
    np.testing.assert_array_equal(values, [11.0, 13.0, 14.0])
    np.testing.assert_array_equal(values[faces], [[14.0, 11.0, 13.0], [11.0, 14.0, 14.0]])

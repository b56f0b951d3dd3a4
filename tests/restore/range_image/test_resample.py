"""A dense mesh in any pose is resampled to a range grid with its surface and its texture; others are not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from restore.camera.rays import find_rays
from restore.range_image.resample import MIN_VERTICES, STEEP_FRACTION, resample
from restore.scan import SurfaceMesh

WIDTH, HEIGHT = 280.0, 200.0
COLUMNS = 300
PIXELS_PER_MM = 5.0
# Of triangles with chords over a curl of 150 mm, 0.93 mm wide, and of their inverse depth in single precision.
SURFACE_MM = 2e-3
TEXTURE_PX = 0.02  # the same chord, sideways, and single precision
MIN_COVERED = 0.99  # of the mesh's area; pixels on its border count or not
BORDER_FRACTION = 0.02  # of the samples lie within one of the border, and the view is not quite from infinity

ROTATIONS = [(0, 0, 0), (40, -25, 10), (0, 90, 0), (75, 0, 130), (180, 0, 0), (10, 160, -70)]


def mesh(height=None, *, columns=COLUMNS):
    """A page of quads; height(u, v) gives its place (x, z) mm for u mm to the right and v mm up from its middle."""
    rows = round(columns * HEIGHT / WIDTH)
    u, v = np.meshgrid(np.linspace(-0.5, 0.5, columns) * WIDTH, np.linspace(-0.5, 0.5, rows) * HEIGHT)
    x, z = (u, 0 * u) if height is None else height(u, v)
    vertices = np.stack([x, v, z], axis=-1).reshape(-1, 3)
    k = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]))
    faces = np.vstack([np.column_stack([a, b, d]), np.column_stack([a, d, c])])
    texcoords = np.column_stack([u.ravel() + WIDTH / 2, HEIGHT / 2 - v.ravel()]) * PIXELS_PER_MM
    return SurfaceMesh(vertices, faces, texcoords, np.zeros((4, 4, 3), np.uint8), {"file": "a.obj"})


def curl(u, v):
    return 150 * np.sin(u / 150), 150 * (1 - np.cos(u / 150))


def turned(mesh, degrees, shift=(300.0, -200.0, 900.0)):
    rotation = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    return replace(mesh, vertices=mesh.vertices @ rotation.T + shift)


def samples(scan, rays):
    """Points (n, 3) mm in the mesh's own frame, and their texture pixels (n, 2)."""
    rows, cols = np.nonzero(scan.measured)
    points = rays.points(rows, cols, -1.0 / scan.points[rows, cols, 2])
    return points, scan.texture_xy[rows, cols]


@pytest.mark.parametrize("degrees", ROTATIONS)
def test_samples_and_texture_positions_are_exact_for_any_rotation_of_the_mesh(degrees):
    page = mesh(curl)
    scan, rays = resample(turned(page, degrees))
    points, pixels = samples(scan, rays)
    own = (points - [300.0, -200.0, 900.0]) @ Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
    assert np.abs(np.hypot(own[:, 0], own[:, 2] - 150) - 150).max() < SURFACE_MM
    u = 150 * np.arctan2(own[:, 0], 150 - own[:, 2])
    expected = np.column_stack([u + WIDTH / 2, HEIGHT / 2 - own[:, 1]]) * PIXELS_PER_MM
    np.testing.assert_allclose(pixels, expected, atol=TEXTURE_PX)
    covered = np.ptp(pixels, axis=0) / PIXELS_PER_MM
    assert covered[0] > MIN_COVERED * WIDTH
    assert covered[1] > MIN_COVERED * HEIGHT


def test_the_resampled_scan_has_the_rays_of_one_pinhole():
    page = mesh(curl)
    scan, rays = resample(page)
    found = find_rays(scan)
    assert found is not None
    for name in ("x0", "dx", "y0", "dy"):
        assert getattr(found, name) == pytest.approx(getattr(rays, name), abs=1e-6 * rays.dx)
    assert scan.provenance == page.provenance
    assert scan.texture is page.texture


def test_a_level_page_gets_as_many_samples_as_it_has_vertices():
    page = mesh()
    assert resample(page)[0].measured.sum() == pytest.approx(len(page.vertices), rel=BORDER_FRACTION)


def test_the_steepest_part_of_a_page_is_sampled_as_densely_as_its_vertices():
    """The curl stands at ±0.93 radians at its ends, and 5 % of it more steeply than 0.89."""
    page = mesh(curl)
    shadow = np.sin(WIDTH / 2 / 150) / (WIDTH / 2 / 150)
    wanted = len(page.vertices) * shadow / np.cos((1 - STEEP_FRACTION) * WIDTH / 2 / 150) ** 2
    assert resample(page)[0].measured.sum() == pytest.approx(wanted, rel=2 * BORDER_FRACTION)


def test_the_picture_shows_the_print_upright_and_not_mirrored():
    scan, _ = resample(turned(mesh(curl), (20, -15, 5)))
    middle = scan.texture_xy[scan.measured.shape[0] // 2]
    along = middle[np.isfinite(middle[:, 0]), 0]
    assert (np.diff(along) > 0).all()
    column = scan.texture_xy[:, scan.measured.shape[1] // 2, 1]
    assert (np.diff(column[np.isfinite(column)]) > 0).all()


@pytest.mark.parametrize("degrees", [(0, 0, 0), (0, 0, 30), (0, 0, 90), (0, 0, -45)])
def test_sides_cross_the_rows_of_the_view(degrees):
    """Along a row a side would be known to half a sample."""
    inside = resample(turned(mesh(curl), degrees))[0].measured
    lowest = inside.shape[0] - 1 - np.argmax(inside[::-1], axis=0)[inside.any(axis=0)]
    assert np.ptp(lowest) > 8
    assert len(np.unique(lowest)) > 8


def test_the_winding_of_the_faces_does_not_matter():
    page = mesh(curl)
    straight, _ = resample(page)
    some = np.random.default_rng(0).random(len(page.faces)) < 0.4
    for which in (np.ones(len(page.faces), bool), some):
        other, _ = resample(replace(page, faces=np.where(which[:, None], page.faces[:, ::-1], page.faces)))
        np.testing.assert_allclose(other.points, straight.points, atol=SURFACE_MM)


def test_a_mesh_without_texture_is_resampled():
    scan, _ = resample(replace(mesh(curl), texcoords=None, texture=None))
    assert scan.texture is None
    assert scan.measured.mean() > 0.8  # the view is askew


def test_all_pieces_of_a_torn_page_are_resampled():
    page = mesh(curl)
    middle = page.vertices[page.faces].mean(axis=1)
    torn = replace(page, faces=page.faces[np.abs(middle[:, 0] - 0.1 * middle[:, 1]) > 2.0])
    scan, rays = resample(torn)
    points, _ = samples(scan, rays)
    leaning = points[:, 0] - 0.1 * points[:, 1]
    assert (leaning < -2).sum() > 20_000
    assert (leaning > 2).sum() > 20_000
    assert np.abs(leaning).min() > 1.0


def overhang(u, v):
    """The right end rolls over by 150°."""
    angle = np.maximum(u, 0) / (WIDTH / 2) * np.deg2rad(150)
    radius = WIDTH / 2 / np.deg2rad(150)
    return np.where(u < 0, u, radius * np.sin(angle)), np.where(u < 0, 0.0, radius * (1 - np.cos(angle)))


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(mesh(overhang), id="an overhang hides part of it"),
        pytest.param(mesh(curl, columns=round((MIN_VERTICES * WIDTH / HEIGHT) ** 0.5) - 2), id="too coarse"),
    ],
)
def test_a_mesh_with_occluded_parts_is_not_resampled(page):
    assert resample(turned(page, (20, 10, 30))) is None


def test_a_curl_just_below_an_overhang_is_resampled():
    assert resample(mesh(lambda u, v: (105 * np.sin(u / 105), 105 * (1 - np.cos(u / 105))))) is not None

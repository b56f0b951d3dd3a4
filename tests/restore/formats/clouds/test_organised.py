"""Organised clouds come back in the scanner's frame, whatever axes.

Units and marks of missing points they have.
"""

import itertools

import numpy as np
import pytest

from oracles.clouds import CAMERA, write_npz, write_ply
from restore.camera.rays import find_rays
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.organised import MAX_SAMPLES, coarsened, flying_pixels
from restore.formats.clouds.ply_cloud import has_faces
from restore.formats.ply_data import parse_ply
from restore.scan import RangeScan
from tests.restore.formats.conftest import make_shot

SIZE = "comment width 32\ncomment height 24\n"
TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])  # a rotation
POSED_MM = 0.01


@pytest.mark.parametrize("signs", list(itertools.product((1.0, -1.0), repeat=3)))
def test_axes_of_any_direction_give_the_same_scan(tmp_path, sheet, same_as, signs):
    write_ply(tmp_path / "a.ply", sheet, axes=np.array(signs), remark=SIZE)
    same_as(load_scan(tmp_path / "a.ply"), sheet)


def test_a_camera_that_was_turned_by_a_right_angle(tmp_path, sheet, same_as):
    turned = RangeScan(sheet.points[..., [1, 0, 2]] * [1.0, -1.0, 1.0], sheet.texture, sheet.texture_xy)
    write_ply(tmp_path / "a.ply", turned, remark=SIZE)
    same_as(load_scan(tmp_path / "a.ply"), sheet)


@pytest.mark.parametrize("missing", [0.0, np.nan, np.inf])
def test_points_at_the_origin_and_points_that_are_not_numbers_are_missing(tmp_path, sheet, same_as, missing):
    write_ply(tmp_path / "a.ply", sheet, missing=missing, remark=SIZE)
    same_as(load_scan(tmp_path / "a.ply"), sheet)


def test_metres_are_scaled_by_their_unit(tmp_path, sheet, same_as):
    write_ply(tmp_path / "a.ply", sheet, axes=CAMERA * 1e-3, remark=SIZE)
    scan = load_scan(tmp_path / "a.ply", unit="m")
    same_as(scan, sheet)
    assert (scan.provenance["unit"], scan.provenance["unit_source"]) == ("m", "given")


def test_a_frame_of_a_robot_keeps_distances_and_the_side_that_is_printed(tmp_path, sheet):
    points = sheet.points @ TURNED.T + [300.0, -200.0, 500.0]
    write_ply(tmp_path / "a.ply", RangeScan(points, sheet.texture, sheet.texture_xy), axes=np.ones(3), remark=SIZE)
    scan = load_scan(tmp_path / "a.ply")
    both = scan.measured & sheet.measured
    assert both.sum() == sheet.measured.sum()
    a, b = scan.points[both], sheet.points[both]
    u, _, vt = np.linalg.svd((a - a.mean(0)).T @ (b - b.mean(0)))
    assert np.linalg.det(u @ vt) > 0
    np.testing.assert_allclose((a - a.mean(0)) @ u @ vt, b - b.mean(0), atol=POSED_MM)
    assert (scan.points[both][:, 2] < 0).all()


def test_a_picture_that_is_given_replaces_the_colours(tmp_path, sheet):
    from PIL import Image

    write_npz(tmp_path / "a.npz", sheet)
    Image.new("RGB", (64, 48), (1, 2, 3)).save(tmp_path / "b.png")
    scan = load_scan(tmp_path / "a.npz", tmp_path / "b.png")
    assert scan.texture.shape == (48, 64, 3)
    np.testing.assert_allclose(scan.texture_xy[0, 0], [0.5, 0.5])


def test_pixels_between_two_depths_are_left_out_and_noise_is_not(sheet):
    rng = np.random.default_rng(0)
    depth = np.full((60, 80), 700.0) + rng.normal(0, 0.3, (60, 80))
    depth[:, 40:] += 30.0
    depth[:, 40] = 715.0
    rays = np.stack(np.meshgrid(np.arange(80) - 40, 30 - np.arange(60)), axis=-1) / 1900.0
    points = np.dstack([rays * depth[..., None], -depth])
    flying = flying_pixels(points)
    assert flying[1:-1, 40].all()
    assert flying.sum() == flying[:, 40].sum()


def test_a_large_grid_is_averaged_and_keeps_rays_and_picture():
    fine = make_shot(1200, 1600, whole=True, missing=0.0)
    scan = coarsened(fine)
    assert scan.points.shape == (600, 800, 3)
    assert scan.points[..., 0].size <= MAX_SAMPLES
    assert scan.texture is fine.texture
    rays, own = find_rays(fine), find_rays(scan)
    np.testing.assert_allclose([own.dx, own.dy], [2 * rays.dx, 2 * rays.dy], rtol=1e-5)


def test_a_cloud_without_a_point_is_refused(tmp_path, sheet):
    nothing = RangeScan(np.full_like(sheet.points, np.nan), sheet.texture, sheet.texture_xy)
    write_ply(tmp_path / "a.ply", nothing, remark=SIZE)
    with pytest.raises(BadInput, match="no point that was measured"):
        load_scan(tmp_path / "a.ply")


def test_a_file_that_promises_faces_is_not_a_cloud(tmp_path, sheet):
    write_ply(path := tmp_path / "a.ply", sheet, remark=SIZE)
    data = path.read_bytes()
    assert not has_faces(parse_ply(path, data))
    points = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    face = (
        points + b"element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    )
    assert has_faces(parse_ply(path, face))

"""Depth images with the intrinsics of each program, their scale.

Their kind of depth and their colour image.
"""

import json

import cv2
import numpy as np
import pytest
from PIL import Image

from oracles.clouds import colours_of_samples, write_depth
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.intrinsics import read_intrinsics
from tests.restore.formats.conftest import MIDDLE_PX

STEP_MM = 0.02
ROUNDING_MM = 0.6 * STEP_MM  # half a step, and along x and y less


@pytest.mark.parametrize("kind", ["open3d", "realsense"])
def test_intrinsics_that_state_the_step(tmp_path, sheet, same_as, kind):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind=kind, step_mm=STEP_MM)
    scan = load_scan(tmp_path / "a")
    same_as(scan, sheet, within=ROUNDING_MM)
    assert scan.provenance["depth"] == "axis"


@pytest.mark.parametrize("kind", ["ros", "tum"])
def test_intrinsics_that_leave_the_step_to_the_unit(tmp_path, sheet, same_as, kind):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind=kind, step_mm=STEP_MM)
    same_as(load_scan(tmp_path / "a", unit="0.02mm"), sheet, within=ROUNDING_MM)
    same_as(load_scan(tmp_path / "a" / "depth.png", unit="0.02mm"), sheet, within=ROUNDING_MM)


def test_whole_numbers_are_millimetres_and_fractions_metres(tmp_path, sheet, same_as):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind="tum", step_mm=1.0)
    scan = load_scan(tmp_path / "a")
    same_as(scan, sheet, within=0.6)
    assert [one.code for one in scan.findings] == ["depth_step_assumed"]
    assert load_scan(tmp_path / "a", unit="mm").findings == ()
    write_depth(tmp_path / "b", sheet, MIDDLE_PX, kind="float")
    same_as(load_scan(tmp_path / "b", depth="axis"), sheet, within=1e-3)


def test_lengths_of_rays_are_asked_for_where_both_are_possible(tmp_path, sheet, same_as):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind="float", length=True)
    with pytest.raises(BadInput, match="not stated") as raised:
        load_scan(tmp_path / "a")
    assert "--depth axis" in raised.value.hint
    same_as(load_scan(tmp_path / "a", depth="ray"), sheet, within=1e-3)
    with pytest.raises(BadInput, match="not a kind of depth"):
        load_scan(tmp_path / "a", depth="length")


@pytest.mark.parametrize("model", ["brown_conrady", "inverse_brown_conrady", "kannala_brandt4"])
def test_distortion_of_the_lens(tmp_path, sheet, model):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind="realsense", step_mm=STEP_MM)
    facts = json.loads((tmp_path / "a" / "intrinsics.json").read_text())
    coefficients = [0.1, -0.2, 1e-3, -2e-3, 0.05] if "brown" in model else [0.1, -0.02, 0.01, 0.0, 0.0]
    (tmp_path / "a" / "intrinsics.json").write_text(json.dumps(facts | {"model": model, "coeffs": coefficients}))
    scan = load_scan(tmp_path / "a")
    known = scan.measured
    row, col = (axis.astype(float) for axis in np.nonzero(known))
    x, y = scan.points[known][:, 0] / -scan.points[known][:, 2], -scan.points[known][:, 1] / -scan.points[known][:, 2]
    u, v = (col - facts["ppx"]) / facts["fx"], (row - facts["ppy"]) / facts["fy"]
    if model == "inverse_brown_conrady":
        x, y, u, v = u, v, x, y  # its polynomial leads from the picture to the rays
    still, straight, d = np.zeros(3), np.column_stack([x, y, np.ones_like(x)]), np.array(coefficients)
    if model.startswith("kannala"):
        found = cv2.fisheye.projectPoints(straight[:, None], still, still, np.eye(3), d[:4])[0]
    else:
        found = cv2.projectPoints(straight, still, still, np.eye(3), d)[0]
    np.testing.assert_allclose(found.reshape(-1, 2), np.column_stack([u, v]), atol=1e-6)


def test_a_colour_image_of_another_camera_is_projected(tmp_path, sheet):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind="realsense", step_mm=STEP_MM)
    path = tmp_path / "a" / "intrinsics.json"
    depth = json.loads(path.read_text())
    camera = {"width": 200, "height": 100, "fx": 3000.0, "fy": 3000.0, "ppx": 120.0, "ppy": 40.0}
    pose = {"rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [0.015, 0.001, 0.0]}
    path.write_text(json.dumps({"depth": depth, "color": camera, "extrinsics": pose}))
    Image.new("RGB", (200, 100)).save(tmp_path / "a" / "color.png")
    scan = load_scan(tmp_path / "a")
    assert scan.texture.shape == (100, 200, 3)
    x, y, z = (scan.points[10, 12] * [1, -1, -1]) + [15.0, 1.0, 0.0]
    np.testing.assert_allclose(scan.texture_xy[10, 12], [3000.0 * x / z + 120.0, 3000.0 * y / z + 40.0], atol=1e-6)


def test_a_larger_colour_image_of_the_same_view(tmp_path, sheet):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, step_mm=STEP_MM)
    Image.fromarray(np.kron(colours_of_samples(sheet), np.ones((3, 3, 1), np.uint8))).save(tmp_path / "a" / "color.png")
    assert load_scan(tmp_path / "a").texture_xy[2, 5].tolist() == [16.0, 7.0]
    Image.new("RGB", (50, 50)).save(tmp_path / "a" / "color.png")
    with pytest.raises(BadInput, match="does not fit"):
        load_scan(tmp_path / "a")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.txt", "525 526 319.5 239.5"),
        ("a.txt", "525 0 319.5\n0 526 239.5\n0 0 1"),
        ("a.json", '{"intrinsic_matrix": [525, 0, 0, 0, 526, 0, 319.5, 239.5, 1]}'),
        ("a.json", '{"depth": {"fx": 525, "fy": 526, "ppx": 319.5, "ppy": 239.5}}'),
        ("a.yaml", "K: [525, 0, 319.5, 0, 526, 239.5, 0, 0, 1]\n"),
    ],
)
def test_every_program_states_the_same_camera(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    camera = read_intrinsics(tmp_path / name)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (525.0, 526.0, 319.5, 239.5)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("intrinsics.json", "{}"),
        ("intrinsics.json", "[" * 5000),
        ("intrinsics.json", '{"fx": 1e400, "fy": 1, "cx": 0, "cy": 0}'),
        ("intrinsics.json", '{"fx": "a", "fy": 1, "cx": 0, "cy": 0}'),
        ("intrinsics.json", '{"intrinsic_matrix": [1, 2, 3]}'),
        ("intrinsics.json", '{"fx": 9, "fy": 9, "cx": 0, "cy": 0, "model": "new", "coeffs": [1]}'),
        ("camera_info.yaml", "camera_name: d\n"),
        ("intrinsics.txt", "1 2 3"),
        ("intrinsics.txt", "-5 5 3 3"),
    ],
)
def test_what_is_not_a_camera_is_refused(tmp_path, sheet, name, text):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX, kind="")
    (tmp_path / "a" / "intrinsics.json").unlink()
    (tmp_path / "a" / name).write_text(text)
    with pytest.raises(BadInput, match=name):
        load_scan(tmp_path / "a", depth="axis")


def test_an_image_that_is_cut_short_and_one_of_another_size(tmp_path, sheet):
    write_depth(tmp_path / "a", sheet, MIDDLE_PX)
    data = (tmp_path / "a" / "depth.png").read_bytes()
    (tmp_path / "a" / "depth.png").write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInput, match=r"depth\.png"):
        load_scan(tmp_path / "a")
    Image.fromarray(np.ones((9, 9), np.uint16)).save(tmp_path / "a" / "depth.png")
    with pytest.raises(BadInput, match="9 × 9 pixels"):
        load_scan(tmp_path / "a")

"""Exports of phones' scanning programs: cameras where they were, the page cut out of the mesh, faults told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from oracles.markers import rigid_residual
from oracles.phones import to_arkit, write_polycam, write_scanner_app
from restore import Settings, load_capture, load_scan, restore
from restore.errors import BadInput, NotEnoughSurface
from restore.mesh.measures import surface_area
from restore.phones import capture, polycam, scanner_app
from restore.phones.arkit import world_to_mm
from restore.phones.detect import is_phone_capture
from restore.texture.page import MM_PER_INCH
from station.cli import main
from tests.restore.phones.conftest import PAGE_MM

READERS = {"Polycam": polycam, "3d Scanner App": scanner_app}
WRITERS = {"Polycam": write_polycam, "3d Scanner App": write_scanner_app}
EXACT_PX = 0.02  # the numbers are written with all digits; the OBJ's with a thousandth of a millimetre
EXACT_MM = 1e-3  # single precision of metres in the GLB
AREA = 0.1  # of the page's: at its rim the mesh hangs to the table over one face of 8 mm
LAYOUT_MM = 1.5  # rms: the noise of the mesh makes it longer, its chords shorter, its rim stretches the page
SIZE_MM = 12.0  # the mesh hangs from the rim over one face of 8 mm, of which some is taken for the page


@pytest.fixture(params=WRITERS)
def program(request):
    return request.param


@pytest.fixture
def folder(tmp_path, program, taken, mesh):
    WRITERS[program](tmp_path, taken, mesh)
    return tmp_path


def to_world(points):
    """(n, 3) mm in the frame of a capture of points (n, 3) mm of the scene, before the page is turned upright."""
    return world_to_mm(to_arkit(points))


@pytest.mark.slow
def test_cameras_see_points_where_the_photographs_show_them(tmp_path, program, taken, mesh):
    WRITERS[program](tmp_path, taken, mesh)
    frames, _ = READERS[program].read_frames(tmp_path)
    assert len(frames) == len(taken.cameras)
    points = taken.scene.surface(np.random.default_rng(0).uniform([0, 0], PAGE_MM, (50, 2)))
    for frame, camera in zip(frames, taken.cameras, strict=True):
        np.testing.assert_allclose(frame.camera.project(to_world(points)), camera.project(points), atol=EXACT_PX)


@pytest.mark.slow
def test_the_mesh_lies_in_the_frame_of_the_cameras(tmp_path, program, taken, mesh):
    WRITERS[program](tmp_path, taken, mesh)
    np.testing.assert_allclose(READERS[program].read_mesh(tmp_path).vertices, to_world(mesh[0]), atol=EXACT_MM)


@pytest.mark.slow
def test_the_page_is_cut_out_and_painted_true_to_scale(folder, program, taken):
    capture = load_capture(folder)
    assert capture.scan.provenance["device"] == program
    assert any("some millimetres" in one.text for one in capture.scan.findings)
    area = surface_area(capture.scan.vertices, capture.scan.faces)
    assert abs(area / np.prod(PAGE_MM) - 1) < AREA
    page = restore(capture.scan, Settings(points=500, dpi=100), photos=capture.photographs)
    np.testing.assert_allclose(page.report["page_mm"], PAGE_MM, atol=SIZE_MM)
    assert all(photo["accepted"] for photo in page.report["photos"])
    rows, cols = np.nonzero((page.page_source > 0) & (page.page_source < 255))
    rows, cols = rows[::50], cols[::50]
    true = np.full((len(rows), 2), np.nan)
    cameras = [photograph.camera.focal_px for photograph in capture.photographs]
    numbers = [[camera.focal_px for camera in taken.cameras].index(focal) for focal in cameras]
    for index, number in enumerate(numbers, 1):
        here = page.page_source[rows, cols] == index
        if here.any():
            true[here], _ = taken.truth_at(number, page.page_map[rows[here], cols[here]].astype(float))
    known = np.isfinite(true).all(axis=1)
    assert known.mean() > 0.85
    error, _ = rigid_residual(np.stack([cols, -rows], axis=1)[known] * MM_PER_INCH / page.dpi, true[known])
    assert np.sqrt((error**2).sum(axis=1).mean()) < LAYOUT_MM


def test_a_folder_of_something_else_is_not_a_capture(tmp_path):
    assert not is_phone_capture(tmp_path)
    assert not is_phone_capture(tmp_path / "gone")
    with pytest.raises(BadInput, match=r"scan\.json"):
        load_capture(tmp_path)


def one_camera(folder: Path) -> Path:
    return sorted([*folder.glob("keyframes/corrected_cameras/*.json"), *folder.glob("frame_*.json")])[0]


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"fx": NaN}', "{" * 50_000])
def test_a_damaged_camera_is_named(folder, text):
    path = one_camera(folder)
    path.write_text(text)
    with pytest.raises(BadInput, match=path.name):
        load_capture(folder)


def test_a_pose_that_is_not_a_motion_is_refused(folder):
    path = one_camera(folder)
    fields = json.loads(path.read_text())
    if "t_00" in fields:
        fields["t_00"] += 0.5
    else:
        fields["cameraPoseARFrame"][0] += 0.5
    path.write_text(json.dumps(fields))
    with pytest.raises(BadInput, match="not a rotation"):
        load_capture(folder)


def test_a_mesh_that_no_photograph_shows_is_refused(tmp_path, program, taken, mesh):
    WRITERS[program](tmp_path, taken, (mesh[0] + [5000.0, 0.0, 0.0], mesh[1]))
    with pytest.raises(NotEnoughSurface, match="no paper on the mesh"):
        load_capture(tmp_path)


def test_a_mesh_larger_than_any_page_is_refused(folder, monkeypatch):
    monkeypatch.setattr(capture, "MAX_FACES", 1000)
    with pytest.raises(BadInput, match="more paper than any page"):
        load_capture(folder)


def test_without_corrected_images_the_distortion_is_warned_of(tmp_path, taken, mesh):
    write_polycam(tmp_path, taken, mesh, corrected=False)
    assert "distortion" in load_capture(tmp_path).scan.findings[0].text


def test_a_picture_of_another_size_is_refused(tmp_path, taken, mesh):
    write_polycam(tmp_path, taken, mesh)
    path = sorted(tmp_path.glob("keyframes/corrected_images/*.jpg"))[2]
    Image.new("RGB", (320, 240)).save(path)
    with pytest.raises(BadInput, match="320 × 240"):
        load_capture(tmp_path)


@pytest.mark.slow
def test_the_command_restores_a_folder(tmp_path, taken, mesh, capsys):
    folder = tmp_path / "capture"
    folder.mkdir()
    write_scanner_app(folder, taken, mesh)
    assert main(["restore", str(folder), "-o", str(tmp_path / "out"), "--points", "300", "--dpi", "72", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["source"]["device"] == "3d Scanner App"
    assert len(report["photos"]) == len(taken.cameras)
    assert main(["restore", str(folder), "-o", str(tmp_path / "b"), "--texture", str(folder / "frame_00000.jpg")]) == 3
    assert "has its own photographs" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "word"), [("a.r3d", "Record3D"), ("a.usdz", "GLB"), ("a.zip", "unpack")])
def test_unsupported_input_is_reported_with_a_workaround(tmp_path, name, word):
    (tmp_path / name).write_bytes(b"PK")
    with pytest.raises(BadInput) as fault:
        load_scan(tmp_path / name)
    assert word in fault.value.hint

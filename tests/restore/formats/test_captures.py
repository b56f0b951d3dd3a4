"""Folders of captured patterns: read in order, refused with the reason and the remedy."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Text, Wave
from oracles.simulation.projector import RigPlan, build_rig
from oracles.structured_light import captured, encode_calibration, fields_of, greys, rig_of, write_captures
from restore.errors import BadInput, NotEnoughSurface
from restore.formats import load_scan
from restore.formats.captures import _in_order
from restore.structured_light import scan_captures

PLAN = RigPlan(size=(240, 180), projector=(160, 100), distance_mm=500.0, baseline_mm=180.0, view_mm=210.0)


@pytest.fixture(scope="module")
def simulated():
    return build_rig(Wave(wavelength_mm=90.0), Text(seed=3), PLAN, page_mm=(130.0, 100.0))


@pytest.fixture(scope="module")
def pictures(simulated):
    return captured(simulated, seed=5)


@pytest.fixture
def folder(tmp_path, simulated, pictures):
    write_captures(tmp_path, pictures, rig_of(simulated))
    return tmp_path


def test_a_folder_is_the_scan_of_its_pictures(folder, simulated, pictures):
    scan = load_scan(folder)
    direct = scan_captures(greys(pictures), pictures[-2], rig_of(simulated))
    np.testing.assert_array_equal(scan.points, direct.points)
    np.testing.assert_array_equal(scan.texture, pictures[-2])
    assert scan.provenance["device"] == "structured light"


@pytest.mark.parametrize("suffix", [".xml", ".json", ".yaml"])
def test_every_way_of_opencv_to_write_a_calibration_is_read(folder, simulated, suffix):
    before = load_scan(folder)
    (folder / "calibration.yml").unlink()
    (folder / f"calibration{suffix}").write_text(encode_calibration(fields_of(rig_of(simulated)), suffix))
    np.testing.assert_allclose(load_scan(folder).points, before.points, atol=1e-6)


def test_the_resolution_of_the_projector_may_be_in_the_calibration(folder, simulated):
    (folder / "patterns.json").unlink()
    with pytest.raises(BadInput, match="resolution of the projector") as fault:
        load_scan(folder)
    assert "proj_size" in fault.value.hint
    text = encode_calibration(fields_of(rig_of(simulated)))
    (folder / "calibration.yml").write_text(text + "proj_size: [ 160, 100 ]\n")
    assert load_scan(folder).provenance["projector"] == [160, 100]


def test_names_are_sorted_as_people_number_them(tmp_path):
    names = ["capture_2.png", "capture_10.png", "Capture_1.png", "capture_02b.png"]
    ordered = sorted((tmp_path / name for name in names), key=_in_order)
    assert [path.name for path in ordered] == ["Capture_1.png", "capture_2.png", "capture_02b.png", "capture_10.png"]


def test_a_missing_picture_is_reported_before_any_is_read(folder):
    (folder / "capture_7.png").unlink()
    (folder / "capture_8.png").write_bytes(b"no picture")
    with pytest.raises(BadInput, match=r"holds 31 images.*are 32"):
        load_scan(folder)


def test_pictures_of_two_sizes_are_refused_by_name(folder):
    Image.fromarray(np.zeros((90, 120, 3), np.uint8)).save(folder / "capture_9.png")
    with pytest.raises(BadInput, match=r"capture_9.png has 120 × 90 pixels, capture_0.png has 240 × 180"):
        load_scan(folder)


def test_dark_pictures_are_refused(folder):
    for path in folder.glob("*.png"):
        Image.fromarray(np.zeros((180, 240, 3), np.uint8)).save(path)
    with pytest.raises(NotEnoughSurface, match=r"0.0% of the image"):
        load_scan(folder)


def test_a_texture_of_its_own_is_refused(folder):
    with pytest.raises(BadInput, match="own image"):
        load_scan(folder, texture=folder / "capture_0.png")


@pytest.mark.parametrize("text", ["", "[]", '{"projector": [160]}', '{"projector": ["a", 2]}', "{"])
def test_a_damaged_index_is_refused(folder, text):
    (folder / "patterns.json").write_text(text)
    with pytest.raises(BadInput, match=r"patterns\.json"):
        load_scan(folder)


def test_an_index_of_another_projector_contradicts_the_pictures(folder):
    (folder / "patterns.json").write_text(json.dumps({"projector": [1280, 800]}))
    with pytest.raises(BadInput, match="are 44"):
        load_scan(folder)

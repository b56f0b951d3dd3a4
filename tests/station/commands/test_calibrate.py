"""`planish board` and `planish calibrate` on scans of a body that hides its geometry."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Flat, Markers, Pose, shoot
from drivers.vivid900.geometry.calibration import nominal, read_calibration
from drivers.vivid900.geometry.lenses import FAST, LENSES
from drivers.vivid900.geometry.triangulation import points_of
from restore.formats import save_scan
from station.cli import main

pytestmark = pytest.mark.slow

MANUAL = nominal(LENSES["MIDDLE"], body="77", lens_serial="114")
HIDDEN = replace(MANUAL, baseline_mm=251.0, focal_px=1932.0, distortion=(-0.06, 0.05), plane=(1e-3, -3e-3, 0.0, 0.0))
POSES = [(750, 0, 0), (750, 25, 90), (1000, -25, 0), (1000, 20, 60)]


@pytest.fixture(scope="module")
def scans(tmp_path_factory) -> list[str]:
    folder = tmp_path_factory.mktemp("boards")
    for k, (distance, tilt, turn) in enumerate(POSES):
        pose = Pose(tilt_deg=tilt, turn_deg=turn)
        board = {"mode": "fast", "distance_mm": float(distance), "pose": pose, "table": "none", "seed": k}
        scan, _ = shoot(Flat(), Markers(), body=HIDDEN, calibration=MANUAL, **board)
        save_scan(scan, folder / f"{k}.scan")
    return [str(folder / f"{k}.scan") for k in range(len(POSES))]


def error_mm(calibration) -> float:
    pitch = np.arange(240.0)[:, None] + 17.5 + np.zeros((1, 320))
    off = points_of(pitch, calibration, FAST, 900.0) - points_of(pitch, HIDDEN, FAST, 900.0)
    return float(np.linalg.norm(off, axis=-1).max())


def test_a_body_is_calibrated_from_its_scans(scans, tmp_path, capsys) -> None:
    output = tmp_path / "body.toml"
    assert main(["calibrate", f"{scans[0]}@750", *scans[1:], "-o", str(output), "--json"]) == 0
    reported = json.loads(capsys.readouterr().out)
    found = read_calibration(output)
    assert (found.lens, found.body, found.lens_serial) == ("MIDDLE", "77", "114")
    assert reported["calibration"]["focal_px"] == found.focal_px
    assert reported["markers_px"] < 0.15
    assert reported["sigma"]["pupil_mm"] < 2.0  # of the prior's 3: the measured distance was heard
    assert error_mm(MANUAL) > 3.0
    assert error_mm(found) < 4 * reported["expected_mm"] < 4.0
    assert "4 captures" in output.read_text("utf-8")


def test_nothing_is_overwritten_unasked(scans, tmp_path, capsys) -> None:
    output = tmp_path / "body.toml"
    output.write_text("mine")
    assert main(["calibrate", *scans, "-o", str(output)]) == 2
    assert "--force" in capsys.readouterr().err
    assert output.read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "code", "reported"),
    [
        (["nowhere.scan"], 3, "nowhere.scan"),
        (["nowhere.scan@610"], 3, "nowhere.scan"),
        (["mesh.stl"], 3, "is a mesh"),
        (["{scan}", "--columns", "50", "--rows", "50"], 2, "250 markers"),
        (["{scan}", "--marker-size", "30"], 2, "overlap"),
    ],
)
def test_what_cannot_be_calibrated_from_is_refused(
    scans, tmp_path, monkeypatch, capsys, arguments, code, reported
) -> None:
    monkeypatch.chdir(tmp_path)
    triangle = ("0 0 0", "1 0 0", "0 1 0")
    corners = "".join(f"vertex {corner}\n" for corner in triangle)
    (tmp_path / "mesh.stl").write_text(f"solid a\nfacet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\nendsolid")
    given = [argument.format(scan=scans[0]) for argument in arguments]
    assert main(["calibrate", *given, "-o", "body.toml"]) == code
    assert reported in capsys.readouterr().err
    assert not (tmp_path / "body.toml").exists()


@pytest.mark.parametrize(("command", "name"), [("board", "board.pdf"), ("board", "board"), ("card", "card.png")])
def test_a_name_of_another_format_is_refused(tmp_path, capsys, command, name) -> None:
    assert main([command, "-o", str(tmp_path / name)]) == 2
    assert "which is what is written" in capsys.readouterr().err
    assert not (tmp_path / name).exists()


def test_the_board_prints_true_to_scale(tmp_path) -> None:
    output = tmp_path / "board.png"
    size = ["--columns", "5", "--rows", "4", "--marker-size", "20", "--marker-pitch", "30"]
    assert main(["board", "-o", str(output), *size]) == 0
    with Image.open(output) as picture:
        assert picture.info["dpi"] == pytest.approx((300, 300), abs=0.02)
        page = np.asarray(picture)
    finder = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250))
    corners, ids, _ = finder.detectMarkers(page)
    assert sorted(ids.ravel()) == list(range(20))
    sides = [np.linalg.norm(quad[0, 1] - quad[0, 0]) * 25.4 / 300 for quad in corners]
    assert sides == pytest.approx([20.0] * 20, abs=0.2)  # the finder counts whole pixels of 0.085 mm, at both ends
    assert main(["board", "-o", str(output)]) == 2

"""The simulated depth camera: openings as organised clouds, with its noise."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.shipped import CONFIGS
from drivers.simulated import config as settings_table
from drivers.simulated.program import main, noisy, picture_opening
from restore import load_scan
from station.config import load_config

OPENING = {"sheet": "flat", "artwork": "text", "page_mm": [200, 150], "table": "none"}
TABLE = settings_table.read({"book": [OPENING, {**OPENING, "artwork": "white"}]})
NOISE_MM = 0.1
TOLERANCE = 0.1  # of a deviation over 300,000 samples of which four are one


@pytest.fixture(scope="module")
def shots(tmp_path_factory):
    """An opening without noise and with it."""
    found = []
    for noise_mm in (0.0, NOISE_MM):
        path = tmp_path_factory.mktemp("shot") / "shot.ply"
        path.write_bytes(picture_opening(TABLE, 0, 0, noise_mm))
        found.append(load_scan(path))
    return found


def test_an_opening_is_an_organised_cloud_in_colour(shots):
    exact, _ = shots
    assert exact.points.shape == (480, 640, 3)
    x, y, z = exact.points[exact.measured].T
    assert np.ptp(x) == pytest.approx(200, abs=1)
    assert np.ptp(y) == pytest.approx(150, abs=1)
    assert np.all(z < 0)
    row = exact.points[240][exact.measured[240]]
    assert np.all(np.diff(row[:, 0]) > 0)  # columns run to the right: not mirrored
    assert len(np.unique(exact.texture)) > 100


def test_its_noise_is_that_of_a_depth_camera(shots):
    exact, taken = shots
    both = exact.measured & taken.measured
    error = np.where(both, np.linalg.norm(taken.points - exact.points, axis=2), np.nan)
    assert np.sqrt(np.nanmean(error**2)) == pytest.approx(NOISE_MM, rel=TOLERANCE)


def test_noise_is_along_the_rays_and_correlated_over_two_samples():
    points = np.dstack([*np.mgrid[:200, :200].astype(float), np.full((200, 200), -900.0)])
    moved = noisy(points, NOISE_MM, np.random.default_rng(1)) - points
    assert np.abs(np.cross(moved, points)).max() < 1e-9
    along = moved[..., 2]
    assert np.mean(along[:, 2:] * along[:, :-2]) / np.var(along) == pytest.approx(np.exp(-1), abs=TOLERANCE)


def test_the_program_writes_a_file_and_says_what_is_wrong(tmp_path, monkeypatch, capsys):
    (tmp_path / "book.toml").write_text('[scanner]\nlens = "NONE"\n')
    monkeypatch.setattr("sys.argv", ["program", str(tmp_path / "book.toml"), str(tmp_path / "shot.ply")])
    assert main() == 1
    out = capsys.readouterr()
    assert out.out == "progress 0.1 projecting\n"
    assert "scanner.lens" in out.err
    assert not (tmp_path / "shot.ply").exists()


def test_its_configuration_is_shipped():
    station = load_config(CONFIGS / "program.toml")
    assert station.scanner["capture"][3] == str((CONFIGS / "simulated-book.toml").resolve())
    assert [one.name for one in station.capture.declared()] == ["noise_mm", "average", "deadline_s"]

"""The real driver over the simulated device, behind the door of all scanners."""

import json
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers import SettingsError, open_scanner
from drivers.scanner import TransportError
from drivers.simulated.imaging.exposure import GAIN_STEP, exposure_for_paper, relative_exposure
from drivers.simulated.imaging.shot import Truth
from drivers.simulated.scanner import connect, connect_turntable, rig
from drivers.simulated.scene.artwork import ARTWORK
from drivers.simulated.scene.sheets import SHEETS
from drivers.vivid900.capture.camera import Vivid900
from drivers.vivid900.errors import NothingMeasured
from drivers.vivid900.geometry.calibration import encode_calibration, nominal
from drivers.vivid900.geometry.lenses import LENSES, MODES
from drivers.vivid900.settings import VividSettings
from restore.scan import RangeScan
from restore.texture.super_resolution import MIN_SHOTS, registration, super_resolve

NOON = datetime(2024, 5, 17, 12, 0, tzinfo=UTC)
FAST = VividSettings(mode="fast")
PLACE_PX = 0.05  # two pictures with noise are laid on each other to a few hundredths
HALF = 0.05  # of a quotient of two spreads from tens of thousands of samples, and of strays left out
STATION = """
driver = "simulated"
lens = "WIDE"
distance_mm = 650
seed = 7

[scene]
page_mm = [297, 210]
artwork = "white"
table = "light"
gap_mm = 10

[scene.sheet]
name = "multifold"
creases = [[-60, 5, 30], [40, -3, -35]]

[scene.pose]
tilt_deg = 4
shift_mm = [2, 3, 0]
"""


def noon() -> datetime:
    return NOON


def small(**settings: Any) -> dict[str, Any]:
    return {"driver": "simulated", "scene": {"sheet": "flat", "artwork": "white", "table": "none"}, **settings}


@dataclass
class Shots:
    """Two shots of one scanner, and the progress of the first."""

    scans: list[RangeScan]
    progress: list[tuple[str, float]]


def take_two(progress: Callable[[str, float], None]) -> list[RangeScan]:
    scanner = connect(small(), now=noon)
    return [scanner.capture(FAST, progress), scanner.capture(FAST)]


@pytest.fixture(scope="module")
def plain() -> Shots:
    steps: list[tuple[str, float]] = []
    return Shots(take_two(lambda step, done: steps.append((step, done))), steps)


@pytest.fixture(scope="module")
def truth() -> Truth:
    return rig(small()).sensor.truth(MODES["fast"])


def test_a_station_configuration_opens_it() -> None:
    with open_scanner(tomllib.loads(STATION)) as scanner:
        scan = scanner.capture(FAST)
    assert scan.points.shape == (240, 320, 3)
    assert scan.measured.mean() > 0.5
    assert scan.provenance["lens"] == "WIDE"
    assert scan.provenance["distance_mm"] == 650


@pytest.mark.parametrize(("sheet", "artwork"), [(s, "white") for s in SHEETS] + [("flat", a) for a in ARTWORK])
def test_every_sheet_and_artwork_can_be_asked_for_by_name(sheet: str, artwork: str) -> None:
    connect(small(scene={"sheet": sheet, "artwork": {"name": artwork}})).close()


@pytest.mark.slow
def test_provenance_is_complete_and_json(plain: Shots) -> None:
    noted = plain.scans[0].provenance
    assert json.loads(json.dumps(dict(noted))) == noted
    assert noted["time"] == NOON.isoformat()
    assert {"device", "lens", "distance_mm", "mode", "profile", "calibration", "laser_power", "gain"} <= noted.keys()
    assert "SIM" in noted["device"]


@pytest.mark.slow
def test_shots_differ_and_the_series_repeats(plain: Shots) -> None:
    series = [[scan.points for scan in scans] for scans in (plain.scans, take_two(lambda *_: None))]
    np.testing.assert_array_equal(series[0], series[1])
    assert not np.array_equal(series[0][0], series[0][1], equal_nan=True)


def test_the_truth_about_its_shots_is_known(plain: Shots, truth: Truth) -> None:
    assert truth.page_mm == (280.0, 200.0)
    assert np.nanmax(np.abs(plain.scans[0].points - truth.points)) < 20


def test_progress_is_reported(plain: Shots) -> None:
    assert [step for step, done in plain.progress if done == 1.0] == ["focus", "scan"]
    assert all(0 <= done <= 1 for _, done in plain.progress)


def test_a_closed_scanner_shoots_no_more() -> None:
    scanner = connect(small())
    scanner.close()
    scanner.close()
    with pytest.raises(TransportError, match="closed"):
        scanner.capture(FAST)


def test_focus_elsewhere_finds_nothing() -> None:
    with pytest.raises(NothingMeasured):
        connect(small()).capture(VividSettings(mode="fast", distance_mm=600))


@pytest.mark.parametrize("distance", [500.0, 900.0, 2500.0])
def test_the_device_chooses_what_suits_white_paper(distance: float) -> None:
    power, gain = exposure_for_paper(distance)
    assert 1 / GAIN_STEP < relative_exposure(distance, power, gain) < GAIN_STEP
    assert 1 <= power <= 255
    assert 0 <= gain <= 7


@pytest.mark.slow
def test_laser_and_gain_are_obeyed() -> None:
    dim = connect(small()).capture(VividSettings(mode="fast", laser_power=1, gain=0))
    assert dim.measured.mean() < 0.05
    assert (dim.provenance["laser_power"], dim.provenance["gain"]) == (1, 0)
    with pytest.raises(NothingMeasured):  # everything is overexposed
        connect(small()).capture(VividSettings(mode="fast", laser_power=255, gain=7))


@pytest.mark.parametrize(
    ("settings", "setting", "choice"),
    [
        ({"lens": "FISHEYE"}, "scanner.lens", "TELE"),
        ({"distance_mm": 100}, "scanner.distance_mm", "500"),
        ({"colour": 1}, "scanner.colour", "distance_mm"),
        ({"scene": {"sheet": "origami"}}, "scene.sheet", "miura"),
        ({"scene": {"sheet": {"name": "curl", "radius": 3}}}, "scene.sheet.radius", "radius_mm"),
        ({"scene": {"sheet": {"name": "curl", "radius_mm": 0}}}, "scene.sheet.radius_mm", "20 or more"),
        ({"scene": {"sheet": {"name": "spread", "slope_deg": 95}}}, "scene.sheet.slope_deg", "80"),
        ({"scene": {"sheet": {"slope_deg": 95}}}, "scene.sheet", "binding"),
        ({"scene": {"artwork": "mona lisa"}}, "scene.artwork", "markers"),
        ({"scene": {"artwork": {"name": "text", "face": "gothic"}}}, "scene.artwork.face", "serif"),
        ({"scene": {"table": "glass"}}, "scene.table", "dark"),
        ({"scene": {"page_mm": [5, 200]}}, "scene.page_mm.0", "20"),
        ({"scene": {"pose": {"roll": 3}}}, "scene.pose.roll", "tilt_deg"),
        ({"scene": {"sheet": {"name": "curl", "radius_mm": 70}}}, "curl", "bend it less"),
        (
            {"scene": {"sheet": {"name": "multifold", "creases": [[0, 40, 20], [9, -40, 20]]}}},
            "creases",
            "do not cross",
        ),
    ],
)
def test_an_impossible_setting_is_refused_by_name_with_the_choices(
    settings: dict[str, Any], setting: str, choice: str
) -> None:
    with pytest.raises(SettingsError) as refused:
        open_scanner({"driver": "simulated", **settings})
    assert setting in str(refused.value)
    assert choice in f"{refused.value} {refused.value.hint}"


@pytest.mark.slow
def test_four_shots_halve_the_noise_against_the_truth(plain: Shots, truth: Truth) -> None:
    four = connect(small(seed=1)).capture(replace(FAST, average=4))
    assert z_noise(four, truth) / z_noise(plain.scans[0], truth) == pytest.approx(0.5, rel=HALF)


def z_noise(scan: RangeScan, truth: Truth) -> float:
    """Standard deviation of depth, mm, from the quartiles: strays do not count."""
    error = (scan.points - truth.points)[..., 2]
    low, high = np.nanpercentile(error, [25, 75])
    return float(high - low) / 1.349  # of a normal distribution


def test_the_station_configuration_that_is_bundled_runs_the_real_driver(repository: Path) -> None:
    config = tomllib.loads((repository / "configs" / "simulated.toml").read_text("utf-8"))
    with open_scanner({**config["scanner"], "scene": {"sheet": "flat", "artwork": "white"}}) as scanner:
        assert isinstance(scanner, Vivid900)
        assert scanner.state == "ready"


def test_a_calibration_of_another_lens_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "wide.toml"
    path.write_text(encode_calibration(nominal(LENSES["WIDE"])), "utf-8")
    with connect(small(calibration=str(path))) as scanner, pytest.raises(SettingsError, match="MIDDLE"):
        scanner.capture(FAST)


def test_a_calibration_is_used(plain: Shots, tmp_path: Path) -> None:
    path = tmp_path / "middle.toml"
    longer = replace(nominal(LENSES["MIDDLE"]), baseline_mm=255.0)
    path.write_text(encode_calibration(longer), "utf-8")
    with connect(small(calibration=str(path))) as scanner:
        one, two = plain.scans[0], scanner.capture(FAST)
    assert two.provenance["calibration"]["baseline_mm"] == 255.0
    assert np.nanmean(two.points[..., 2] / one.points[..., 2]) == pytest.approx(255 / 250, rel=1e-3)


@pytest.mark.slow
def test_a_body_hides_its_geometry_from_the_driver(tmp_path: Path) -> None:
    path = tmp_path / "hidden.toml"
    hidden = replace(nominal(LENSES["MIDDLE"]), baseline_mm=255.0)
    path.write_text(encode_calibration(hidden), "utf-8")
    flat = {"sheet": "flat", "artwork": "white"}
    with connect(small(body=str(path), scene=flat)) as not_reported:
        wrong = not_reported.capture(FAST)
    with connect(small(body=str(path), calibration=str(path), scene=flat)) as reported_all:
        right = reported_all.capture(FAST)
    assert wrong.provenance["calibration"]["baseline_mm"] == 250.0
    assert np.nanmedian(right.points[..., 2]) == pytest.approx(-921.5, abs=0.1)
    assert np.nanmedian(wrong.points[..., 2]) == pytest.approx(-921.5 * 250 / 255, rel=2e-3)
    with pytest.raises(SettingsError, match=r"of the lens MIDDLE"):
        connect(small(body=str(path), lens="WIDE"))


def printed(**settings: Any) -> dict[str, Any]:
    return {"driver": "simulated", "scene": {"sheet": "flat", "artwork": "text", "page_mm": [200, 140]}, **settings}


def moved(one: RangeScan, other: RangeScan) -> np.ndarray:
    """(2,) pixels from the colour image of one shot to that of another."""
    return registration(one.texture, other.texture, name="other")[:, 2]


@pytest.fixture(scope="module")
def touched() -> list[RangeScan]:
    """Shots of a page that a hand moves by up to a pixel between them."""
    with connect(printed(nudge_px=1.0)) as scanner:
        return [scanner.capture(FAST) for _ in range(MIN_SHOTS)]


@pytest.mark.slow
def test_a_hand_moves_the_page_between_captures(touched: list[RangeScan]) -> None:
    first, second, third, *_ = touched
    shifts = np.array([moved(first, second), moved(first, third)])
    assert np.abs(shifts).max() <= 1.0 + 2 * PLACE_PX  # of the corner, where the turn that was found adds its own
    assert np.linalg.norm(shifts, axis=1).min() > 2 * PLACE_PX
    assert np.linalg.norm(shifts[0] - shifts[1]) > 2 * PLACE_PX


@pytest.mark.slow
def test_it_keeps_off_during_a_capture() -> None:
    average = replace(FAST, average=2)
    with connect(printed(nudge_px=5.0)) as nudged, connect(printed()) as still:
        np.testing.assert_array_equal(nudged.capture(average).texture, still.capture(average).texture)


@pytest.mark.slow
def test_captures_of_a_page_that_was_touched_are_joined_to_a_finer_one(touched: list[RangeScan]) -> None:
    joined = super_resolve(touched)
    assert joined.texture.shape == (960, 1280, 3)
    assert joined.provenance["super_resolution"]["captures"] == MIN_SHOTS


@pytest.mark.slow
def test_a_page_on_a_turntable_is_never_touched() -> None:
    with connect_turntable(printed(nudge_px=5.0), "MMC-2") as (scanner, _):
        first, second = (scanner.capture(FAST) for _ in range(2))
    assert np.abs(moved(first, second)).max() < PLACE_PX

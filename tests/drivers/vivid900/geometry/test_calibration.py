"""Calibration files: what is written is read back, and anything else is refused with the declared error."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.scanner import SettingsError
from drivers.vivid900.geometry.calibration import (
    Calibration,
    Measurement,
    calibration_of,
    encode_calibration,
    nominal,
    read_calibration,
)
from drivers.vivid900.geometry.lenses import LENSES
from restore.files import MAX_TOML_BYTES

BODY = Calibration(
    lens="MIDDLE",
    baseline_mm=251.37,
    focal_px=1938.1,
    pupil_mm=21.1,
    centre_px=(322.4, 236.0),
    distortion=(-0.07, 0.1),
    plane=(1e-4, -2e-3, 1e-3, 3e-4),
    tilt=6e-4,
    bow=-1e-3,
    body='1001187 "B"\\',
    lens_serial="MIDDLE\n7",
)

small = st.floats(-0.01, 0.01)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "body.toml"


def test_a_file_gives_back_what_was_saved(path: Path) -> None:
    path.write_text(encode_calibration(BODY, comments=["taken on a Monday"]), "utf-8")
    assert read_calibration(path) == BODY
    assert path.read_text("utf-8").splitlines()[1] == "# taken on a Monday"


@settings(deadline=None)
@given(focal=st.floats(500, 5000), plane=st.tuples(small, small, small, small), serial=st.text(max_size=64))
def test_provenance_gives_back_what_was_noted(focal: float, plane: tuple, serial: str) -> None:
    body = replace(BODY, focal_px=focal, plane=plane, body=serial, distortion=(0.0, 0.0))
    assert calibration_of(body.as_json(), "provenance") == body


@settings(deadline=None)
@given(serial=st.text(st.characters(exclude_categories=["Cs"]), max_size=64))
def test_any_serial_number_can_be_written(tmp_path_factory: pytest.TempPathFactory, serial: str) -> None:
    path = tmp_path_factory.mktemp("calibration") / "body.toml"
    path.write_text(encode_calibration(replace(BODY, body=serial)), "utf-8")
    assert read_calibration(path).body == serial


@pytest.mark.parametrize("markers_px", [0.07, None])
def test_how_it_was_measured_is_kept(path: Path, markers_px: float | None) -> None:
    measured = replace(BODY, measured=Measurement("2026-01-31", 12, 0.15, 0.02, markers_px, markers_px and 1e-4))
    path.write_text(encode_calibration(measured), "utf-8")
    assert read_calibration(path) == measured
    assert calibration_of(measured.as_json(), "") == measured
    assert "measured" not in BODY.as_json()


def test_an_invalid_date_is_refused(path: Path) -> None:
    measured = replace(BODY, measured=Measurement("yesterday", 12, 0.15, 0.02))
    path.write_text(encode_calibration(measured), "utf-8")
    with pytest.raises(SettingsError, match="date"):
        read_calibration(path)


@pytest.mark.parametrize("lens", LENSES)
def test_nominal_figures_are_the_manuals(lens: str) -> None:
    body = nominal(LENSES[lens], body="7", lens_serial="8")
    assert (body.lens, body.focal_px, body.pupil_mm) == (lens, LENSES[lens].focal_px, LENSES[lens].pupil_mm)
    assert (body.baseline_mm, body.body, body.lens_serial) == (250.0, "7", "8")
    assert calibration_of(body.as_json(), "nominal") == body


DAMAGES = {
    "empty": lambda text: "",
    "no format": lambda text: text.replace("format = 1\n", ""),
    "a later format": lambda text: text.replace("format = 1", "format = 2"),
    "cut short": lambda text: text[: len(text) // 2],
    "not TOML": lambda text: "\x00" + text,
    "a value missing": lambda text: text.replace("baseline_mm = 251.37\n", ""),
    "a value too many": lambda text: text + "colour = 3\n",
    "a lens that is none": lambda text: text.replace('"MIDDLE"', '"ZOOM"'),
    "not a number": lambda text: text.replace("1938.1", "nan"),
    "infinite": lambda text: text.replace("tilt = 0.0006", "tilt = inf"),
    "a baseline of another machine": lambda text: text.replace("251.37", "25.137"),
    "three coefficients": lambda text: text.replace(", 0.0003]", "]"),
    "folded over by distortion": lambda text: text.replace("[-0.07, 0.1]", "[-9.0, 0.0]"),
    "a stripe that turns back": lambda text: text.replace("-0.002", "-1.5"),
    "too long": lambda text: text + "#\n" * MAX_TOML_BYTES,
    "nested too deep": lambda text: text + "deep = " + "[" * 20000,
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_file_is_refused(path: Path, damage: str) -> None:
    whole = encode_calibration(BODY)
    damaged = DAMAGES[damage](whole)
    assert damaged != whole
    path.write_text(damaged, "utf-8")
    with pytest.raises(SettingsError, match=r"body\.toml") as refusal:
        read_calibration(path)
    assert "planish calibrate" in refusal.value.hint


@settings(deadline=None)
@given(data=st.binary(max_size=200))
def test_any_bytes_are_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("calibration") / "body.toml"
    path.write_bytes(data)
    with pytest.raises(SettingsError):
        read_calibration(path)


def test_a_missing_file_is_named(path: Path) -> None:
    with pytest.raises(SettingsError, match="No such file"):
        read_calibration(path)

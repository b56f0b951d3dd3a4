"""Presets: those that come along, labels and sides, one's own."""

from __future__ import annotations

import pytest

from restore import Settings
from station.errors import UsageError
from station.session.derivation.restoration import RestoreParameters
from station.session.terms.presets import PRESETS, Preset, load_preset
from station.verdict.table import MEASURES
from station.verdict.thresholds import Thresholds, check_limits

UNLIMITED = "size_ci95_mm"  # a limit needs a measured calibration


@pytest.mark.parametrize("path", sorted(PRESETS.glob("*.toml")), ids=lambda path: path.stem)
def test_presets_that_are_bundled_are_usable(path):
    preset = load_preset(path.stem)
    parameters = RestoreParameters.model_validate(preset.parameters())
    assert parameters.settings == Settings.model_validate(preset.settings)
    assert {name for name, limits in preset.thresholds if limits is None} == {
        "size_ci95_mm"
    }  # needs a measured calibration
    assert Preset.model_validate(preset.model_dump(mode="json", exclude_none=True)) == preset


def test_every_measure_has_one_direction():
    assert set(MEASURES) == set(Thresholds.model_fields)
    check_limits("blur_px", (1.2, 1.2))
    check_limits("blur_px", None)


def test_a_session_with_limits_in_the_other_order_is_read_as_before():
    assert Preset.model_validate({"thresholds": {"blur_px": [2.0, 1.2]}}).thresholds.blur_px == (2.0, 1.2)


def test_sides_alternate_from_the_first():
    folios = Preset(foliation="folios", first=3, sides="right")
    assert [folios.side(n) for n in (1, 2, 3)] == ["right", "left", "right"]
    assert Preset().side(1) == ""


def test_a_preset_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('outputs = ["tiff"]\n[settings]\ndpi = 300\n[thresholds]\nsmooth_strain_rms = [0.1, 0.2]\n')
    preset = load_preset(str(path))
    assert preset.parameters()["outputs"] == ["coverage", "tiff"]
    assert preset.parameters()["settings"]["dpi"] == 300
    assert (preset.thresholds.smooth_strain_rms, preset.thresholds.hole_mm) == ((0.1, 0.2), None)


def test_a_preset_that_is_not_there_names_the_file_that_was_meant_and_those_that_are(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shipped = "a bundled one: book, crumpled, leaflet, map"
    for name in ("mine", "mine.toml", "./mine", ""):
        with pytest.raises(UsageError, match=f"^the preset '{name}' does not exist$") as caught:
            load_preset(name)
        assert caught.value.hint == f"give the path of a TOML file, or {shipped}"
    (tmp_path / "mine.toml").write_text("first = 1\n")
    with pytest.raises(UsageError) as caught:
        load_preset("./mine")
    assert caught.value.hint == f"give the whole name, mine.toml, or {shipped}"


def test_an_unreadable_preset_is_refused_with_the_reason(tmp_path):
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    for name, why in {"folder": "it is a folder", "bytes": "is not a TOML file"}.items():
        with pytest.raises(UsageError, match=why):
            load_preset(str(tmp_path / f"{name}.toml"))


def test_a_preset_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(b"\xef\xbb\xbf[settings]\r\ndpi = 300\r\n")
    assert load_preset(str(path)).settings == {"dpi": 300}


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[settings]\ndpi = 1", "dpi"),
        ('outputs = ["x"]', "outputs"),
        ("foliation = 1", "foliation"),
        ("[thresholds]\nhole_mm = 1", "hole_mm"),
        ("[thresholds]\nblur_px = [2.0, 1.2]", r"thresholds\.blur_px: .*more is worse"),
        ("[thresholds]\nmeasured_fraction = [0.9, 0.97]", r"thresholds\.measured_fraction: .*less is worse"),
        ("[thresholds]\nmeasured_fraction = [0.9, 0.9]", r"thresholds\.measured_fraction: .*less is worse"),
        ("x = 1", "x"),
        ("x =", "is not a TOML file"),
    ],
)
def test_what_is_wrong_with_a_preset_is_named(tmp_path, text, named):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(UsageError, match=named):
        load_preset(str(path))

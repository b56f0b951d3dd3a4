"""`planish patterns` draws what `planish restore` reads back from the captures of a simulated rig."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from drivers.simulated import Text, Wave
from oracles.simulation.projector import RigPlan, build_rig
from oracles.structured_light import encode_calibration, fields_of, rig_of
from station.cli import main
from tests.station.conftest import fault

PLAN = RigPlan(size=(320, 240), projector=(240, 150), distance_mm=500.0, baseline_mm=180.0, view_mm=210.0)
PAGE_MM = (130.0, 100.0)
SIZE_MM = 4.4  # samples of 1.8 mm, of which one and a quarter is lost or gained at each side


@pytest.fixture
def drawn(tmp_path, capsys):
    folder = tmp_path / "patterns"
    assert main(["patterns", "-o", str(folder), "--projector", "240x150"]) == 0
    assert "34 patterns" in capsys.readouterr().out
    return folder


def test_the_patterns_are_numbered_in_order(drawn):
    names = sorted(path.name for path in drawn.iterdir())
    assert names == [f"pattern_{number:02d}.png" for number in range(34)] + ["patterns.json"]
    assert np.array(Image.open(drawn / "pattern_32.png")).min() == 255
    assert np.array(Image.open(drawn / "pattern_33.png")).max() == 0
    assert json.loads((drawn / "patterns.json").read_text()) == {"projector": [240, 150], "patterns": 34}


@pytest.mark.slow
def test_captures_of_the_patterns_become_a_page(drawn, tmp_path, capsys):
    simulated = build_rig(Wave(wavelength_mm=90.0), Text(seed=3), PLAN, page_mm=PAGE_MM)
    shown = [np.array(Image.open(drawn / f"pattern_{number:02d}.png"))[..., 0] for number in range(34)]
    captures = tmp_path / "page"
    captures.mkdir()
    for number, picture in enumerate(simulated.captures(shown, np.random.default_rng(1))):
        Image.fromarray(picture).save(captures / f"{number}.png")
    (captures / "patterns.json").write_bytes((drawn / "patterns.json").read_bytes())
    (captures / "calibration.yml").write_text(encode_calibration(fields_of(rig_of(simulated))))
    out = tmp_path / "out"
    assert main(["restore", str(captures), "-o", str(out), "--points", "300", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(report["page_mm"], PAGE_MM, atol=SIZE_MM)
    assert report["source"]["device"] == "structured light"
    assert (out / "page.png").exists()


@pytest.mark.parametrize("size", ["1280", "1280x", "ax3", "3x4", "0x0", "99999x99999", "800x1"])
def test_no_resolution_is_refused_before_anything_is_written(tmp_path, capsys, size):
    assert main(["patterns", "-o", str(tmp_path / "p"), "--projector", size]) == 2
    message, hint = fault(capsys.readouterr().err)
    assert message.startswith("--projector: ")
    assert size.split("x")[0] in message
    assert "1280x800" in hint
    assert not (tmp_path / "p").exists()


def test_patterns_are_not_overwritten_without_force(drawn):
    assert main(["patterns", "-o", str(drawn), "--projector", "240x150"]) == 2
    assert main(["patterns", "-o", str(drawn), "--projector", "240x150", "--force"]) == 0

"""A restoration as a stage: the same bytes from the same scan, and nothing of time or place in them."""

from __future__ import annotations

import json

import pytest

from restore import Settings, save_scan
from station.choices import Rotation, Sheets
from station.run.options import RunOptions
from station.run.small_page import small_page
from station.session.derivation.restoration import RestoreParameters, run_restore
from station.session.log.store import file_digests

COARSE = {"settings": {"points": 300, "dpi": 60}, "outputs": ["coverage", "tiff"]}


def test_two_runs_in_two_places_give_the_same(tmp_path):
    runs = []
    for name in ("one", "two"):
        save_scan(small_page(), tmp_path / name / "scan")
        runs.append(run_restore(tmp_path / name / "scan", COARSE, tmp_path / name / "made"))
    assert runs[0].result == runs[1].result
    digests = file_digests(tmp_path / "one" / "made")
    assert digests == file_digests(tmp_path / "two" / "made")
    assert sorted(digests) == ["page-coverage.png", "page.png", "page.tif"]
    assert runs[0].facts["seconds"]["total"] > 0
    assert str(tmp_path) not in json.dumps(runs[0].result)


def test_unknown_parameters_are_refused():
    with pytest.raises(ValueError, match="extra"):
        RestoreParameters.model_validate({"colour": "red"})


def test_recorded_parameters_are_those_of_a_run():
    recorded = {"settings": {"dpi": 60}, "outputs": ["tiff"], "language": "lat", "unit": "cm", "rotate": "90"}
    recorded |= {"scale": "148x210", "allow_distorted": True}
    assert RestoreParameters.model_validate(recorded).options() == RunOptions(
        Settings(dpi=60),
        frozenset({"coverage", "tiff"}),
        "lat",
        unit="cm",
        scale="148x210",
        sheets=Sheets.LARGEST,
        both_leaves=True,
        rotate=Rotation.QUARTER,
        allow_distorted=True,
    )

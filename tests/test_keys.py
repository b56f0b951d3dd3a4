"""No public name means two things: the table of keys beside real reports, presets, events and configurations."""

import json
import re
import tomllib
from dataclasses import fields
from typing import get_type_hints

import numpy as np
import pytest

from drivers.vivid900.settings import VividSettings
from oracles import ROOT
from oracles.keys import GENERIC, KEYS, OPEN, keys_of, type_of
from oracles.reference import PAGE, QUALITY, REPORT, quality_measures, reference, report
from restore import PartEdits, Settings, SurfaceMesh, mirror_page, restore, rotate_page
from restore.edits.finish import finish_page
from restore.report import Report
from station.config import StationConfig, TurntableSettings
from station.run.small_page import small_page
from station.session import Volume, add_scan, create_session, open_session, scan_path
from station.session.derivation.quality import record_verdict
from station.session.derivation.restoration import RestoreParameters, run_restore
from station.session.log.steps import decide, record_run
from station.session.terms.parts import RESTORE
from station.session.terms.presets import PRESETS, Preset, load_preset
from station.verdict.thresholds import Thresholds

CORNERS = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 50.0, 0.0], [0.0, 50.0, 0.0]])
PACKAGES = ("drivers", "restore", "station")
MODELS = (Settings, Preset, Thresholds, RestoreParameters, StationConfig, TurntableSettings, Volume)


def wrong_in(value):
    """The keys that the table lacks, or of another type than it says."""
    for key, item in keys_of(value):
        if key in GENERIC:
            continue
        types = KEYS[key].type.split("|") if key in KEYS else ()
        found = type_of(item)
        if found not in types and not (found == "[]" and types and types[0].startswith("[")) and found != "null":
            yield key, found


def test_a_report_has_the_keys_of_the_table():
    page = restore(SurfaceMesh(CORNERS, np.array([[0, 1, 2], [0, 2, 3]])), Settings(dpi=30))
    page = mirror_page(rotate_page(finish_page(page, PartEdits(size_mm=(90.0, 50.0))), 90))
    assert {"edits", "rotation_deg", "mirrored"} <= set(page.report)
    assert dict(wrong_in(json.loads(json.dumps(page.report)))) == {}


def test_events_have_the_keys_of_the_table(tmp_path):
    """A capture, a restoration, its quality check and a decision."""
    create_session(tmp_path / "new", Volume(title="A", preset_values=load_preset("book").model_dump(mode="json")))
    with open_session(tmp_path / "new") as writer:
        capture = add_scan(writer, small_page(), facts={"provenance": small_page().provenance})
        parameters = {"settings": {"points": 300, "dpi": 60}, "outputs": ["coverage"]}
        run = run_restore(scan_path(writer.session, capture), parameters, tmp_path / "run")
        record_verdict(writer, record_run(writer, RESTORE, capture, parameters=parameters, result=run.result))
        decide(writer, "title", "B")
        facts = [dict(event.facts) for event in writer.history.events]
    records = [json.loads(line) for line in (tmp_path / "new" / "events.jsonl").read_bytes().splitlines()]
    assert dict(wrong_in([*facts, *records])) == {}


@pytest.mark.parametrize("path", [*PRESETS.glob("*.toml"), *(ROOT / "configs").glob("*.toml")], ids=lambda p: p.stem)
def test_presets_and_configurations_have_the_keys_of_the_table(path):
    assert dict(wrong_in(tomllib.loads(path.read_text("utf-8")))) == {}


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.__name__)
def test_every_field_that_can_be_set_is_in_the_table(model):
    assert set(model.model_fields) <= set(KEYS)


def test_every_setting_of_a_capture_is_in_the_table():
    assert {one.name for one in fields(VividSettings)} <= set(KEYS)


def test_a_key_has_a_meaning_and_is_in_the_code():
    sources = [path.read_text("utf-8") for package in PACKAGES for path in (ROOT / package).rglob("*.py")]
    used = set(re.findall(r"\w+", "\n".join(sources).lower()))
    assert {name for name, key in KEYS.items() if not key.meaning or name in GENERIC or name not in used} == set()


def test_open_tables_are_keys():
    assert set(KEYS) >= OPEN


def test_the_pages_are_what_the_code_says():
    assert PAGE.read_text("utf-8") == reference()
    assert QUALITY.read_text("utf-8") == quality_measures()
    assert REPORT.read_text("utf-8") == report()


def test_the_page_of_the_report_has_every_key_once():
    named = re.findall(r"^\| `([\w.]+)` \| ", REPORT.read_text("utf-8").partition("| key | meaning")[0], re.MULTILINE)
    assert len(named) == len(set(named))
    assert {name.partition(".")[0] for name in named} == {*get_type_hints(Report), "photogrammetry"}


def test_a_second_meaning_is_found():
    assert dict(wrong_in({"strain": {"rms": 0.1}, "points": "12"})) == {"points": "text"}
    assert dict(wrong_in({"covered_share": 0.1})) == {"covered_share": "number"}

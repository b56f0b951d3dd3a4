"""Verdicts that are recorded: beside the preset's limits and the other pages of the session."""

from __future__ import annotations

import numpy as np
import pytest

from oracles.tiny_scan import tiny_scan
from station.session import Volume, Writer, add_scan, create_session, open_session
from station.session.derivation.quality import lacks_verdict, note_lines, record_verdict, run_verdict, verdict_lines
from station.session.log.results import QualityCheck
from station.session.log.steps import record_run
from station.session.terms.parts import RESTORE
from station.session.terms.presets import Preset
from station.verdict.same_page import fingerprint
from station.verdict.thresholds import Thresholds

LIMITS = Thresholds(smooth_strain_rms=(0.01, 0.02), similarity=(0.84, 0.92))


@pytest.fixture
def writer(tmp_path):
    settings = Preset(thresholds=LIMITS).model_dump(mode="json", exclude_none=True)
    create_session(tmp_path / "book", Volume(title="A book", preset_values=settings))
    with open_session(tmp_path / "book") as opened:
        yield opened


def restored(writer: Writer, seed: int, strain: float):
    capture = add_scan(writer, tiny_scan(seed), facts={})
    print_of = fingerprint(np.random.default_rng(seed).integers(0, 256, (200, 200, 3), np.uint8))
    result = {"measures": {"smooth_strain_rms": strain, "fingerprint": print_of}}
    return record_run(writer, RESTORE, capture, parameters={}, result=result)


def test_a_verdict_is_recorded_once_next_to_the_limits_of_the_preset(writer) -> None:
    run = restored(writer, 1, 0.015)
    assert lacks_verdict(writer.history.page(run.page))
    verdict = record_verdict(writer, run)
    assert not lacks_verdict(writer.history.page(run.page))
    assert verdict.level == "amber"
    lines = verdict_lines("page 1", verdict)
    assert lines[0] == "page 1: AMBER  1 checks"
    assert lines[1].startswith("    amber  strain 1.50% rms")


def test_the_same_print_on_another_page_is_red_and_the_pages_compared_are_inputs(writer) -> None:
    runs = [restored(writer, 1, 0.0), restored(writer, 2, 0.0), restored(writer, 1, 0.0)]
    verdict = record_verdict(writer, runs[2])
    assert verdict.level == "red"
    assert "same page as page 1" in verdict.checks[0].text
    assert [one.event for one in writer.history.events[-1].inputs] == [runs[2].number, runs[0].number, runs[1].number]
    assert record_verdict(writer, runs[1]).level == "green"


def test_a_verdict_notes_a_calibration_that_is_nominal_or_old(writer) -> None:
    run = restored(writer, 1, 0.0)
    reported = {"calibration": {"kind": "nominal"}, "parts": {}}
    result = run_verdict({**run.result, **reported}, {"thresholds": {}}, {}).result
    assert (result["level"], [note["name"] for note in result["notes"]]) == ("green", ["calibration_nominal"])
    (line,) = note_lines(QualityCheck.model_validate(result))
    assert line.startswith("    note   the calibration is nominal: sizes are uncertain by half a per cent")
    record_verdict(writer, run)
    assert "notes" not in writer.history.events[-1].result  # a report without a calibration


def test_a_page_that_could_not_be_restored_has_none(writer) -> None:
    capture = add_scan(writer, tiny_scan(1), facts={})
    record_run(writer, RESTORE, capture, parameters={}, result={"error": "no surface"})
    assert not lacks_verdict(writer.history.page(capture.page))

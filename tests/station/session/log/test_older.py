"""A session that commit b2b246c wrote: two restored and judged pages, decisions, an undo, in records of format 1."""

import json
import tarfile
from pathlib import Path

import pytest

from restore import load_scan
from station.archive.from_session import volume_of
from station.session import decide, open_session, read_session, scan_path
from station.session.derivation.quality import record_verdict
from station.session.derivation.reproduce import DERIVERS, reproduce
from station.session.derivation.restoration import Run
from station.session.fixity.verify import verify
from station.session.leaves.overview import overview
from station.session.log.current import preset_of
from station.session.log.events import FORMAT, RECORD, EventDamaged, decode
from station.session.log.older import FACTS, OLDER_FORMAT, current_facts
from station.session.terms.parts import RESTORE

ARCHIVE = Path(__file__).parent / "format_1.tar.gz"


def keys_of(value):
    """All keys of nested tables, with the names of measures in verdicts."""
    if isinstance(value, dict):
        yield from value
        if "limits" in value:
            yield str(value.get("name"))
        for item in value.values():
            yield from keys_of(item)
    elif isinstance(value, list):
        for item in value:
            yield from keys_of(item)


def earlier_keys(tree):
    """The keys of a tree of renames that are renamed in it at some place."""
    for key, target in tree.items():
        name, below = (target, {}) if isinstance(target, str) else target
        yield from [key] if name != key else []
        yield from earlier_keys(below)


@pytest.fixture
def older(tmp_path):
    with tarfile.open(ARCHIVE) as archive:
        archive.extractall(tmp_path, filter="data")
    return tmp_path / "old-volume"


def test_its_facts_have_the_names_of_today(older):
    seen = {key for event in read_session(older).history.events for key in keys_of(dict(event.facts))}
    written = {key for path in older.rglob(RECORD) for key in keys_of(json.loads(path.read_bytes())["facts"])}
    distinct = {"effective_ppi", "strain_rms", "covered_share", "cut_share", "steps", "white", "anyway", "assurance"}
    assert distinct <= written
    assert not distinct & seen
    again = {
        "coverage",
        "size",
        "points",
        "pieces",
        "interpolated",
        "views",
        "stretch",
        "settings",
        "scale",
        "mode",
        "profile",
    }  # right at other places
    assert not (set(earlier_keys(FACTS)) - again) & seen


def test_each_value_is_read_under_the_name_that_it_has_now(older):
    restored = read_session(older).history.page(2).runs[RESTORE]
    written = json.loads((older / "data" / restored.folder / RECORD).read_bytes())["facts"]
    result, before = restored.facts["result"], written["result"]
    assert result["resolved_ppi"] == before["effective_ppi"]
    assert result["measures"]["sampling_ppi"] == before["measures"]["effective_ppi"] == result["sampling_ppi"]
    assert result["measures"]["measured_fraction"] == before["measures"]["covered_share"]
    assert (
        result["strain"]["chord_strain"]["estimated_fraction"] == before["strain"]["against_chords"]["estimated_share"]
    )
    assert result["coverage"]["occluded"] == before["coverage"]["hidden"]
    assert result["source"]["integrity"] == "read_twice"
    assert (restored.facts["parameters"]["rotate"], restored.facts["parameters"]["allow_distorted"]) == ("90", True)
    assert restored.facts["parameters"]["settings"]["inpaint_mm"] == 1.0


def test_its_scans_are_read_with_the_provenance_of_today(older):
    session = read_session(older)
    provenance = load_scan(scan_path(session, session.history.page(1).capture)).provenance
    assert (provenance["integrity"], provenance["super_resolution"]) == ("read_twice", {"captures": 4, "factor": 1})
    assert provenance["turntable"]["deg"] == 30.0


def test_it_is_verified_shown_and_exported(older):
    assert verify(older).problems == ()
    session = read_session(older)
    assert [page["level"] for page in overview(session)["pages"]] == ["red", "red"]
    assert len(volume_of(session).pages) == 2
    preset = preset_of(session)
    assert (preset.thresholds.smooth_strain_rms, preset.thresholds.sampling_ppi) == ((0.004, 0.02), (60.0, 40.0))
    assert (preset.settings["white_balance"], preset.settings["inpaint_mm"]) == ("keep", 1.0)


def test_it_is_continued_in_the_format_of_today(older):
    with open_session(older) as writer:
        label = decide(writer, "label", "1v", page=2)
        verdict = record_verdict(writer, writer.history.page(2).runs[RESTORE])
    assert (label.format, verdict.format) == (FORMAT, FORMAT)
    assert {event.format for event in read_session(older).history.events} == {OLDER_FORMAT, FORMAT}
    assert verify(older).problems == ()


def test_reproduce_says_what_differs_and_who_wrote_the_record(older, tmp_path):
    """The verdicts follow from the records alone; the restorations are those of another program."""
    session = read_session(older)
    made = list(reproduce(session, tmp_path / "scratch", derivers={**DERIVERS, RESTORE: lambda *_: Run({})}))
    restored, verdict = made[0], made[1]
    assert "result.iterations" in restored.differing
    assert "page.png" in restored.differing
    assert "record format 1; this is" in restored.reason
    assert set(verdict.differing) <= {"result.checks"}  # the words of a check; its level is the same


def test_a_record_of_format_1_keeps_its_line(older):
    line = (older / "data" / "0001-000004-restore" / RECORD).read_bytes()
    event = decode(line)
    assert (event.line, event.format) == (line, OLDER_FORMAT)
    with pytest.raises(EventDamaged):
        decode(line.replace(b'"format":1', b'"format":2', 1).replace(b'"number":4', b'"number":04', 1))


def test_current_facts_leave_others_alone():
    facts = {
        "result": {"method": "sticks", "findings": [{"code": "hidden", "text": "a"}]},
        "value": "points",
        "seconds": 3,
    }
    assert current_facts(facts) == facts

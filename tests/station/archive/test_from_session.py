"""`planish export` of a real session: what its pointers show now is what is delivered."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from restore import RangeScan
from station.archive.formats import Format
from station.archive.from_session import scan_of, volume_of
from station.archive.premis import encode_event
from station.archive.volume import Role
from station.archive.xml import PREMIS
from station.cli import main
from station.images.png import encode_png
from station.session import Volume, add_scan, create_session, open_session, read_session, undo
from station.session.captures.originals import add_original
from station.session.log.steps import decide, record_run
from tests.station.archive.conftest import picture
from tests.station.conftest import curl_scan

STATED = {"uncertainty_mm": {"total": 0.0124, "p95": 0.03}, "size_mm_ci95": [2.74, 1.96]}
NOW = datetime(2026, 3, 4, 5, 6, 7, tzinfo=UTC)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A session of two pages; the first was shot twice and restored."""
    create_session(tmp_path / "book", Volume(title="A book", project="Fragments"), now=lambda: NOW)
    with open_session(tmp_path / "book", now=lambda: NOW) as writer:
        add_scan(writer, curl_scan(), facts={})
        capture = add_scan(writer, curl_scan(), page=1, facts={})
        run = writer.staging("page-0001")
        run.mkdir(parents=True)
        (run / "page.png").write_bytes(encode_png(picture(1), 150.0))
        parameters, result = {"settings": {"dpi": 150}}, {"strain": {"rms": 0.001}, **STATED}
        made = record_run(writer, "restore", capture, parameters=parameters, result=result, files=run)
        record_run(writer, "verdict", made, parameters={}, result={"level": "green", "checks": []})
        decide(writer, "label", "12r", page=1)
        decide(writer, "side", "right", page=1)
        add_scan(writer, curl_scan(), facts={})
    return tmp_path / "book"


def test_the_current_scan_and_what_was_made_of_it_are_the_page(folder) -> None:
    volume = volume_of(read_session(folder))
    first, second = volume.pages
    assert (first.label, first.side, second.label, second.side) == ("12r", "right", "2", "")
    assert first.find(Role.PAGE).name == "pages/0001/restore/page.png"
    assert first.provenance["device"] == "stand-in"
    assert second.find(Role.PAGE) is None
    assert [(event.kind, event.detail) for event in volume.events] == [
        ("capture", "capture, page 1"),
        ("creation", "restore, page 1"),
        ("validation", "verdict, page 1"),
        ("capture", "capture, page 2"),
    ]
    assert all(file.path.is_file() for file in volume.files)


def test_events_name_what_they_read_and_made(folder) -> None:
    _, restore, verdict, _ = volume_of(read_session(folder)).events
    assert "pages/0001/original/scan/points.npz" in restore.sources
    assert restore.results == ("pages/0001/restore/page.png",)
    assert restore.parameters == {"settings": {"dpi": 150}}
    assert verdict.sources == restore.results
    assert verdict.facts["result"] == {"level": "green", "checks": []}


def test_the_preservation_event_carries_how_well_size_and_places_are_known(folder) -> None:
    _, restore, *_ = volume_of(read_session(folder)).events
    note = encode_event(restore).findtext(f".//{PREMIS}eventOutcomeDetailNote")
    assert STATED.items() <= json.loads(note)["result"].items()


def test_what_was_undone_is_not_delivered(folder) -> None:
    with open_session(folder) as writer:
        undo(writer)  # the second page
        undo(writer)  # the side
    (page,) = volume_of(read_session(folder)).pages
    assert page.side == ""


def test_the_scan_of_a_page_is_found(folder) -> None:
    session = read_session(folder)
    page = volume_of(session).pages[1]
    assert isinstance(scan_of(session, page), RangeScan)


def test_a_mesh_is_delivered_in_the_unit_of_its_capture_or_its_restoration(tmp_path) -> None:
    create_session(tmp_path / "book", Volume(title="A book"))
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n")
    with open_session(tmp_path / "book") as writer:
        by_capture = add_original(writer, tmp_path / "a.obj", unit="cm")
        restored = add_original(writer, tmp_path / "a.obj")
        record_run(writer, "restore", restored, parameters={"unit": "in"}, result={})
    session = read_session(tmp_path / "book")
    sizes = [np.ptp(scan_of(session, page).vertices[:, 0]) for page in volume_of(session).pages]
    assert by_capture.page == 1
    assert sizes == [90.0, 228.6]


@pytest.mark.parametrize("kind", Format)
def test_the_command_says_what_is_missing(folder, tmp_path, capsys, kind) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert main(["export", str(folder), "--to", kind, "-o", str(tmp_path / "out")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == f"folder     {tmp_path / 'out'}"
    assert ("missing    page 2: not restored" in lines) == (kind != "mesh")
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_an_unknown_format_and_a_folder_that_is_not_a_session(folder, tmp_path, capsys) -> None:
    assert main(["export", str(folder), "--to", "docx", "-o", str(tmp_path / "out")]) == 2
    assert "give bagit, mets" in capsys.readouterr().err
    assert main(["export", str(tmp_path), "--to", "pdf", "-o", str(tmp_path / "out")]) == 3
    assert not (tmp_path / "out").exists()


def test_an_invalid_address_is_refused_before_the_work(folder, tmp_path, capsys) -> None:
    words = ["export", str(folder), "--to", "iiif", "-o", str(tmp_path / "out"), "--url", "example.org"]
    assert main(words) == 2
    assert "--url: 'example.org'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_planish_verify_checks_an_export(folder, tmp_path, capsys) -> None:
    out = tmp_path / "out"
    main(["export", str(folder), "--to", "tiff", "-o", str(out)])
    assert main(["verify", str(out)]) == 0
    with (out / "0001.tif").open("ab") as file:
        file.write(b"more")
    capsys.readouterr()
    assert main(["verify", str(out)]) == 6
    assert "page 1: 0001.tif is not the file that was written" in capsys.readouterr().out
    assert main(["verify", str(folder)]) == 0  # a session is none


def test_the_master_of_a_cropped_page_is_the_one_that_was_not_cropped(folder) -> None:
    with open_session(folder) as writer:
        capture = writer.history.page(2).capture
        run = writer.staging("page-0002")
        run.mkdir(parents=True)
        for name in ("page.png", "page-master.png", "page-uncropped.png"):
            (run / name).write_bytes(encode_png(picture(2), 150.0))
        record_run(writer, "restore", capture, parameters={}, result={}, files=run)
    roles = {file.path.name: file.role for file in volume_of(read_session(folder)).pages[1].files}
    assert (roles["page-uncropped.png"], roles["page-master.png"]) == (Role.MASTER, Role.OTHER)

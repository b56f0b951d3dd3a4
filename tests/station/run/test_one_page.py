"""One page, from the scanner to the files."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import numpy as np
import pytest

from restore import Settings
from restore.formats import load_scan
from station.config import StationConfig
from station.errors import OverwriteError
from station.run.one_page import Destination, restore_file, scan_page, stem_of
from station.run.options import RunOptions
from station.storage.folder_lock import WORK
from station.storage.journal import JOURNAL

CONFIG = StationConfig(scanner={"driver": "simulated"})


def ticking():
    """A clock on which one second passes every time somebody looks."""
    seconds = count()
    return lambda: float(next(seconds))


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("book.abs.gz", "book"),
        ("book.abs", "book"),
        ("a.b.obj", "a.b"),
        ("02463d562.abs.gz", "02463d562"),
        ("page", "page"),
    ],
)
def test_the_stem_is_the_name_without_the_endings_of_the_format(tmp_path, name, stem):
    assert stem_of(tmp_path / name) == stem


def test_the_stem_of_a_scan_folder(tmp_path, monkeypatch):
    (tmp_path / "letter 2.5.scan").mkdir()
    (tmp_path / "plain.folder").mkdir()
    assert stem_of(tmp_path / "letter 2.5.scan") == "letter 2.5"
    assert stem_of(tmp_path / "plain.folder") == "plain.folder"
    monkeypatch.chdir(tmp_path / "letter 2.5.scan")
    assert stem_of(Path()) == "letter 2.5"


def test_the_seconds_of_a_restoration(library, scan_file, tmp_path):
    outcome = restore_file(scan_file, Destination(tmp_path / "out"), RunOptions(), clock=ticking())
    seconds = outcome.report["seconds"]
    assert (seconds["load"], seconds["separate"], seconds["flatten"], seconds["total"]) == (1, 1, 0.5, 3)


def test_the_seconds_of_a_scan(library, scanner, tmp_path):
    seconds = scan_page(CONFIG, Destination(tmp_path / "out"), RunOptions(), clock=ticking()).report["seconds"]
    assert (seconds["capture"], seconds["store"], seconds["separate"], seconds["total"]) == (1, 1, 1, 4)


def test_the_report_names_input_and_output(library, scan_file, tmp_path):
    texture = tmp_path / "colour.png"
    outcome = restore_file(scan_file, Destination(tmp_path / "out"), RunOptions(), texture=texture)
    assert (outcome.report["scan"], outcome.report["texture"]) == (str(scan_file), str(texture))
    assert outcome.report["files"] == [path.name for path in outcome.files] == ["book.png", "book.json"]


def test_the_stored_scan_is_the_captured_one(library, scanner, scan, tmp_path):
    outcome = scan_page(CONFIG, Destination(tmp_path), RunOptions())
    stored = load_scan(outcome.files[0])
    np.testing.assert_array_equal(stored.points, scan.points)
    np.testing.assert_array_equal(stored.texture, scan.texture)
    assert stored.provenance == scan.provenance


def test_the_scanner_is_let_go_before_the_restoration(library, scanner, tmp_path, monkeypatch):
    closed = []
    restoring = library.restore
    monkeypatch.setattr(
        "station.run.one_page.restore", lambda *a, **k: closed.append(scanner.closed) or restoring(*a, **k)
    )
    scan_page(CONFIG, Destination(tmp_path), RunOptions())
    assert closed == [1]


def test_a_scan_does_not_begin_when_its_result_would_overwrite(library, scanner, tmp_path):
    scan_page(CONFIG, Destination(tmp_path), RunOptions())
    before = (tmp_path / "page.scan" / "scan.json").stat().st_mtime_ns
    with pytest.raises(OverwriteError):
        scan_page(CONFIG, Destination(tmp_path), RunOptions())
    assert scanner.closed == 1
    assert (tmp_path / "page.scan" / "scan.json").stat().st_mtime_ns == before
    scan_page(CONFIG, Destination(tmp_path, force=True), RunOptions())
    assert scanner.closed == 2


def test_the_original_stays_as_it_was(library, scan_file, tmp_path):
    before = scan_file.read_bytes(), scan_file.stat().st_mtime_ns
    restore_file(scan_file, Destination(scan_file.parent), RunOptions())
    restore_file(scan_file, Destination(scan_file.parent, force=True), RunOptions())
    assert (scan_file.read_bytes(), scan_file.stat().st_mtime_ns) == before


def test_the_picture_that_a_scan_refers_to_is_an_original_too(library, scan_file, tmp_path):
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "book.png").write_bytes(b"of the scanner")
    source = tmp_path / "book.ply"
    source.write_bytes(b"ply\ncomment TextureFile tex/book.png\n")
    with pytest.raises(OverwriteError, match="is the original"):
        restore_file(source, Destination(tmp_path / "tex", force=True), RunOptions())
    assert (tmp_path / "tex" / "book.png").read_bytes() == b"of the scanner"


def test_a_page_that_loses_its_light_leaves_its_master(library, scan_file, tmp_path):
    for shading, expected in (("keep", False), ("remove", True)):
        folder = tmp_path / shading
        outcome = restore_file(scan_file, Destination(folder), RunOptions(Settings(shading=shading)))
        assert (folder / "book-master.png").exists() == expected
        assert ("book-master.png" in outcome.report["files"]) == expected


def test_with_force_a_captured_scan_is_kept_and_the_new_one_stored_next_to_it(library, scanner, tmp_path):
    first = scan_page(CONFIG, Destination(tmp_path), RunOptions())
    before = {path.name: path.read_bytes() for path in first.files[0].iterdir()}
    second = scan_page(CONFIG, Destination(tmp_path, force=True), RunOptions())
    third = scan_page(CONFIG, Destination(tmp_path, force=True), RunOptions())
    assert [outcome.files[0].name for outcome in (first, second, third)] == ["page.scan", "page.2.scan", "page.3.scan"]
    assert {path.name: path.read_bytes() for path in first.files[0].iterdir()} == before
    assert third.report["scan"] == str(third.files[0])


def test_results_that_a_run_with_fewer_options_no_longer_writes_go_with_it(library, scan_file, tmp_path):
    out = tmp_path / "out"
    restore_file(scan_file, Destination(out), RunOptions(outputs=frozenset({"tiff", "map", "review"})))
    (out / "notes.txt").write_text("mine")
    outcome = restore_file(scan_file, Destination(out, force=True), RunOptions())
    names = {path.name for path in out.iterdir()}
    assert names == {"notes.txt", *(path.name for path in outcome.files)} == {"notes.txt", "book.png", "book.json"}


def test_a_report_cannot_name_files_that_no_run_writes(library, scan_file, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "page.txt").write_text("mine")
    report = tmp_path / "out" / "book.json"
    report.write_text('{"files": ["../notes.txt", "page.txt", "book.json"]}')
    restore_file(scan_file, Destination(tmp_path / "out", force=True), RunOptions())
    assert (tmp_path / "notes.txt").read_text() == (tmp_path / "out" / "page.txt").read_text() == "mine"


def test_a_run_rolls_back_what_a_dead_one_left_before_it_looks(library, scan_file, tmp_path):
    work = tmp_path / "out" / WORK
    (work / "old").mkdir(parents=True)
    (work / "old" / "book.png").write_bytes(b"earlier")
    (tmp_path / "out" / "book.png").write_bytes(b"half new")
    (work / JOURNAL).write_text('{"put": ["book.png"], "removed": [], "before": ["book.png"]}')
    with pytest.raises(OverwriteError):
        restore_file(scan_file, Destination(tmp_path / "out"), RunOptions())
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["book.png"]
    assert (tmp_path / "out" / "book.png").read_bytes() == b"earlier"

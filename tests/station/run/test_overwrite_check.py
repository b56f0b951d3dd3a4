"""First, do no harm."""

from __future__ import annotations

import errno
import json

import pytest

from station.errors import OverwriteError
from station.run import overwrite_check
from station.run.overwrite_check import check_outputs, superseded


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "book.obj").write_text("v 0 0 0")
    (tmp_path / "book.png").write_bytes(b"the texture of the scan")
    return tmp_path


def outputs(folder):
    return [folder / "book.png", folder / "book.json"]


def test_an_empty_folder_is_free(folder):
    check_outputs(outputs(folder / "out"), [folder / "book.obj"], force=False)


@pytest.mark.parametrize("force", [False, True])
def test_an_original_is_never_overwritten(folder, force):
    with pytest.raises(OverwriteError, match="is the original"):
        check_outputs(outputs(folder), [folder / "book.obj", folder / "book.png"], force=force)


def test_an_original_under_another_name_is_known(folder):
    (folder / "out").mkdir()
    (folder / "out" / "book.png").hardlink_to(folder / "book.png")
    with pytest.raises(OverwriteError, match="is the original"):
        check_outputs(outputs(folder / "out"), [folder / "book.obj", folder / "book.png"], force=True)


def test_a_scan_folder_is_never_written_into(folder):
    for out in (folder, folder / "deeper"):
        with pytest.raises(OverwriteError, match="never changed"):
            check_outputs([out / "page.png", out / "page.json"], [folder], force=True)


def test_next_to_an_original_force_overwrites_only_what_a_run_wrote(folder):
    with pytest.raises(OverwriteError, match="no earlier run wrote it"):
        check_outputs(outputs(folder), [folder / "book.obj"], force=True)
    (folder / "book.json").write_text(json.dumps({"files": ["book.png", "book.json"]}))
    check_outputs(outputs(folder), [folder / "book.obj"], force=True)


@pytest.mark.parametrize("report", ["", "{", "[]", '{"files": 3}', "{}"])
def test_a_report_that_says_nothing_frees_nothing(folder, report):
    (folder / "book.json").write_text(report)
    with pytest.raises(OverwriteError):
        check_outputs(outputs(folder), [folder / "book.obj"], force=True)


def test_an_original_is_never_superseded(folder):
    (folder / "book.json").write_text(json.dumps({"files": ["book.png", "book.tif", "book.json"]}))
    (folder / "book.tif").touch()
    possible = [folder / name for name in ("book.png", "book.tif", "book-map.tif")]
    assert superseded(folder / "book.json", possible, [folder / "book.png"]) == [folder / "book.tif"]


def test_a_disk_that_does_not_give_the_report_ends_the_run(folder, monkeypatch):
    (folder / "book.json").write_text(json.dumps({"files": ["book.tif", "book.json"]}))
    (folder / "book.tif").write_bytes(b"of the earlier run")
    report, possible = folder / "book.json", [folder / "book.tif"]
    assert superseded(report, possible, []) == possible

    def broken(path, _limit):
        raise OSError(errno.EIO, "Input/output error", str(path))

    monkeypatch.setattr(overwrite_check, "read_regular", broken)
    with pytest.raises(OSError, match="Input/output"):
        superseded(report, possible, [])


def test_what_is_not_a_report_supersedes_nothing(folder):
    (folder / "book.json").mkdir()
    assert superseded(folder / "book.json", [folder / "book.png"], []) == []
    assert superseded(folder / "none.json", [folder / "book.png"], []) == []

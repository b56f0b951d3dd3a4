"""The corrections of a loose scan are next to it, and of no other."""

from __future__ import annotations

import json

import pytest

from restore import BadInput
from station.run.edits import digest_of, edits_of


def test_a_scan_without_corrections_has_none(tmp_path):
    assert edits_of(tmp_path / "book.obj", None) is None


def test_corrections_fit_the_file_that_they_name(tmp_path):
    scan = tmp_path / "book.obj"
    scan.write_bytes(b"v 0 0 0\n")
    (tmp_path / "book.edits.json").write_text(json.dumps({"scan": digest_of(scan), "layout": "split"}))
    assert edits_of(scan, None).layout == "split"
    scan.write_bytes(b"v 0 0 1\n")
    with pytest.raises(BadInput, match="another scan"):
        edits_of(scan, None)


def test_a_link_is_read_and_a_folder_refused(tmp_path):
    (tmp_path / "own.json").write_text("{}")
    (tmp_path / "link.json").symlink_to(tmp_path / "own.json")
    assert edits_of(tmp_path / "book.obj", tmp_path / "link.json").layout == "auto"
    with pytest.raises(BadInput, match="folder"):
        edits_of(tmp_path / "book.obj", tmp_path)

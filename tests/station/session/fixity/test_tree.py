"""Digests of a folder's files."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from station.session.fixity.tree import place_of, tree_digests


def test_every_file_link_and_empty_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "a/empty").mkdir(parents=True)
    (tmp_path / "a/one").write_bytes(b"one")
    (tmp_path / "left").mkdir()
    (tmp_path / "left/out").write_bytes(b"out")
    (tmp_path / "link").symlink_to("a")
    os.mkfifo(tmp_path / "pipe")
    assert tree_digests(tmp_path, without="left", workers=2) == {
        "a/empty": "no regular file",
        "a/one": hashlib.sha512(b"one").hexdigest(),
        "link": "no regular file",
        "pipe": "no regular file",
    }
    assert list(tree_digests(tmp_path, without="a/one")) == ["a/empty", "left/out", "link", "pipe"]


def test_a_file_that_cannot_be_read_has_no_digest(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "one").write_bytes(b"one")

    def refuse(path: Path) -> str:
        raise OSError(5, "Input/output error", str(path))

    monkeypatch.setattr("station.session.fixity.tree.file_digest", refuse)
    assert tree_digests(tmp_path, without="") == {"one": "unreadable: Input/output error"}


def test_the_place_of_a_problem() -> None:
    assert (place_of(3), place_of(0)) == ("page 3", "the volume")

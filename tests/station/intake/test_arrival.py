"""The copy of an arrival: all of its files, unchanged, and a digest of what was copied."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from station.intake.arrival import Arrival, Changed
from station.intake.listing import list_files


def arrival_in(folder: Path) -> Arrival:
    listing = list_files(folder, without=folder / "out")
    return Arrival.of(folder, Path("sub/page.obj"), {"tex/page.png": Path("sub/tex/PAGE.PNG")}, listing)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "in/sub/tex").mkdir(parents=True)
    (tmp_path / "in/sub/page.obj").write_bytes(b"mesh")
    (tmp_path / "in/sub/tex/PAGE.PNG").write_bytes(b"picture")
    return tmp_path / "in"


def test_all_files_are_copied_under_the_names_that_the_scan_knows(folder: Path, tmp_path: Path) -> None:
    arrival = arrival_in(folder)
    digest = arrival.copy(tmp_path / "copy")
    assert (tmp_path / "copy/page.obj").read_bytes() == b"mesh"
    assert (tmp_path / "copy/tex/page.png").read_bytes() == b"picture"
    assert arrival.stem == "page"
    data = arrival.as_data(digest)
    assert (data["scan"], data["sha256"]) == ("sub/page.obj", digest)
    assert [size for size, _ in data["files"].values()] == [4, 7]


def test_the_digest_is_of_names_and_contents(folder: Path, tmp_path: Path) -> None:
    first = arrival_in(folder).copy(tmp_path / "1")
    shutil.copytree(folder, tmp_path / "again")
    (tmp_path / "again/sub/page.obj").touch()
    assert arrival_in(tmp_path / "again").copy(tmp_path / "2") == first
    (folder / "sub/tex/PAGE.PNG").write_bytes(b"Picture")
    assert arrival_in(folder).copy(tmp_path / "3") != first


@pytest.mark.parametrize("change", [b"another mesh", b"mes"])
def test_a_file_that_is_no_longer_the_one_that_was_listed(folder: Path, tmp_path: Path, change: bytes) -> None:
    arrival = arrival_in(folder)
    (folder / "sub/page.obj").write_bytes(change)
    with pytest.raises(Changed):
        arrival.copy(tmp_path / "copy")


def test_a_file_that_has_gone(folder: Path, tmp_path: Path) -> None:
    arrival = arrival_in(folder)
    (folder / "sub/page.obj").unlink()
    with pytest.raises(FileNotFoundError):
        arrival.copy(tmp_path / "copy")

"""Folders that cannot be watched are refused, each with its reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from station.errors import UsageError
from station.intake.folders import check_folders
from station.session import Volume, create_session


@pytest.mark.parametrize(("folder", "out"), [("scans", "out"), ("scans", "scans/out")])
def test_results_lie_elsewhere_or_below(tmp_path: Path, folder: str, out: str) -> None:
    (tmp_path / folder).mkdir()
    check_folders(tmp_path / folder, tmp_path / out)


@pytest.mark.parametrize("out", ["scans", "."])
def test_results_would_be_scans_in_the_folder_or_above(tmp_path: Path, out: str) -> None:
    (tmp_path / "scans").mkdir()
    with pytest.raises(UsageError, match="would be scans"):
        check_folders(tmp_path / "scans", tmp_path / out)


def test_a_folder_has_to_be_there(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="is not a folder"):
        check_folders(tmp_path / "scans", tmp_path / "out")


@pytest.mark.parametrize("inside", ["", "data"])
def test_the_scans_of_a_session_are_its_own(tmp_path: Path, inside: str) -> None:
    create_session(tmp_path / "book", Volume(title="Missale"))
    with pytest.raises(UsageError, match="not a folder of scans") as refused:
        check_folders(tmp_path / "book" / inside, tmp_path / "out")
    assert "planish batch" in refused.value.hint

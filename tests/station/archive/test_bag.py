"""A bag of any payload is valid for the Library of Congress's program; names that no manifest holds are refused."""

from __future__ import annotations

import pytest

from restore import BadInput
from station.archive.bag import seal_bag


def test_a_sealed_folder_is_a_bag(tmp_path) -> None:
    bagit = pytest.importorskip("bagit", reason="needs bagit, the Library of Congress's validator")
    for name in ("data/a.txt", "data/sub/Blätter №1.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    seal_bag(tmp_path, {"External-Description": "two\nlines", "Source-Organization": ""})
    bag = bagit.Bag(str(tmp_path))
    assert bag.validate()
    assert bag.info["External-Description"] == "two lines"
    assert bag.info["Payload-Oxum"].endswith(".2")
    assert "Source-Organization" not in bag.info


def test_a_name_with_a_line_end_is_refused(tmp_path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data/a\nb").write_text("x")
    with pytest.raises(BadInput, match="control character"):
        seal_bag(tmp_path, {})

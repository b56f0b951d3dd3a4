"""JSON files are checked against their model; a fault names the file and the field."""

from __future__ import annotations

import pytest
from pydantic import BaseModel

from restore.errors import BadInput
from restore.phones.json_file import MAX_BYTES, read_model


class Size(BaseModel):
    width: int
    height: int = 3


def test_a_file_is_its_model(tmp_path):
    path = tmp_path / "a.json"
    path.write_text('{"width": 4, "other": [1]}')
    assert read_model(path, Size) == Size(width=4)


@pytest.mark.parametrize(("text", "message"), [('{"width": "a"}', "width"), ("{", "its text"), ("", "empty")])
def test_a_fault_names_file_and_field(tmp_path, text, message):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(BadInput, match=rf"a\.json.*{message}"):
        read_model(path, Size)


def test_a_huge_file_is_not_read(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(" " * (MAX_BYTES + 1))
    with pytest.raises(BadInput, match="larger"):
        read_model(path, Size)

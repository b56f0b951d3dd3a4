"""A file that a user named is read whole, or refused with its name."""

import os

import pytest

from restore import BadInput
from station.storage.given_file import read_given


def test_it_is_read_whole(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"a = 1\n")
    assert read_given(tmp_path / "a.toml", 6, "a", "b") == b"a = 1\n"


def test_what_cannot_be_read_is_named(tmp_path):
    (tmp_path / "file").write_bytes(b"1234567")
    os.mkfifo(tmp_path / "pipe")
    for name in ("gone", "file/gone"):
        with pytest.raises(BadInput, match=f"{name} does not exist"):
            read_given(tmp_path / name, 6, "the list", "give a list")
    for path in (tmp_path, tmp_path / "pipe", tmp_path / "file"):
        with pytest.raises(BadInput, match="cannot read the list: it is") as caught:
            read_given(path, 6, "the list", "give a list")
        assert caught.value.hint == "give a list"

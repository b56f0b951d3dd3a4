"""The table of a scanner whose scans arrive in a folder."""

from __future__ import annotations

import pytest

from drivers import SettingsError, settings_of
from drivers.folder.config import read

TABLE = {"driver": "folder", "folder": ".", "pattern": "*.ply"}


def test_a_table_has_a_folder_and_a_pattern():
    assert (read(TABLE).pattern, read(TABLE).settle_s) == ("*.ply", 1.0)
    with pytest.raises(SettingsError, match="average = 2 is out of range"):
        settings_of(TABLE).of({"average": 2})


@pytest.mark.parametrize("keys", [{"pattern": "a/*.ply"}, {"settle_s": -1}, {"speed": 1}, {"folder": None}])
def test_a_mistake_is_named(keys):
    with pytest.raises(SettingsError, match=f"scanner.{next(iter(keys))}") as caught:
        settings_of({**TABLE, **keys})
    assert caught.value.hint

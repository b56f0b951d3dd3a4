"""`planish demo --book` works a shift, and never over an earlier one."""

from __future__ import annotations

import json

import pytest

from oracles.book import BOOK
from station.cli import main


def test_an_earlier_shift_is_never_replaced(tmp_path, capsys):
    (tmp_path / "leaves").mkdir()
    assert main(["demo", "--book", "-o", str(tmp_path), "--force"]) == 2
    assert "leaves" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["leaves"]


@pytest.mark.slow
def test_the_demonstration_ends_in_the_table(tmp_path, capsys):
    assert main(["demo", "--book", "-o", str(tmp_path / "out"), "--json"]) == 0
    shift = json.loads(capsys.readouterr().out)
    found = [(one["number"], one["lies"], one["first"], one["again"]) for one in shift["openings"]]
    assert found == [tuple(row[:4]) for row in BOOK]
    names = [path.name for path in (tmp_path / "out" / "leaves").iterdir()]
    sides = {f"{row.number:02}-{side}.png".replace("-page", "") for row in BOOK for side in row.sides}
    assert set(names) == sides

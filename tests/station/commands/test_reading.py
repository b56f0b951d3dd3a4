"""`planish ocr` and `planish colour` as they are typed: what cannot be read, and where nothing is written."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from station.cli import main


@pytest.mark.parametrize("command", [["ocr"], ["colour", "-o", "camera.icc"]])
def test_a_picture_that_is_not_there_is_named(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([*command, "page.png"]) == 3
    assert "page.png" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_picture_without_a_chart_gives_no_profile(tmp_path, capsys):
    Image.fromarray(np.full((120, 160, 3), 200, np.uint8)).save(tmp_path / "grey.png")
    assert main(["colour", str(tmp_path / "grey.png"), "-o", str(tmp_path / "camera.icc")]) == 3
    assert "chart" in capsys.readouterr().err
    assert not (tmp_path / "camera.icc").exists()

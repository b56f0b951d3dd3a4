"""Where a run writes, and what follows from its settings."""

from pathlib import Path

import pytest

from restore import Settings
from station.run.destination import Destination

HERE = Destination(Path("out"), frozenset({"tiff"}))


def test_the_report_is_the_last_of_the_files():
    names = [path.name for path in HERE.files("page")]
    assert sorted(names) == ["page.json", "page.png", "page.tif"]
    assert names[-1] == "page.json"
    assert {path.parent for path in HERE.files("page")} == {Path("out")}


@pytest.mark.parametrize(
    ("settings", "implied"),
    [
        (Settings(), set()),
        (Settings(shading="remove"), {"master"}),
        (Settings(fill_hidden_mm=2.0), {"coverage"}),
        (Settings(shading="remove", fill_hidden_mm=2.0), {"master", "coverage"}),
    ],
)
def test_settings_imply_outputs(settings, implied):
    assert HERE.with_implied_outputs(settings).kinds == {"tiff"} | implied

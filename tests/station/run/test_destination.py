"""Where a run writes."""

from pathlib import Path

from station.run.destination import Destination
from station.run.options import RunOptions


def test_the_report_is_the_last_of_the_files():
    paths = Destination(Path("out")).files("page", RunOptions(outputs=frozenset({"tiff"})))
    names = [path.name for path in paths]
    assert sorted(names) == ["page.json", "page.png", "page.tif"]
    assert names[-1] == "page.json"
    assert {path.parent for path in paths} == {Path("out")}

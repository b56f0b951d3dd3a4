"""Views on a turntable: every one is kept, whatever happens to the next."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

import drivers
from drivers.scanner import DeviceError
from restore import RangeScan
from restore.errors import BadInput
from restore.formats import load_scan
from restore.turntable import MergedViews, RotationAxis, ViewReport
from station.cli import main
from station.config import AxisSettings, StationConfig, TurntableSettings
from station.errors import OverwriteError, UsageError
from station.run import turntable
from station.run.one_page import Destination
from station.run.options import RunOptions
from station.run.turntable import axis_table, merge_files, scan_views, view_angles

DIGITS = 1e-5  # relative: what the written axis keeps
AXIS = AxisSettings(point_mm=(0.0, 0.0, -900.0), direction=(0.0, 0.0, 2.0))
CONFIG = StationConfig(
    scanner={"driver": "simulated"}, turntable=TurntableSettings(model="MMC-2", port="/dev/ttyUSB0", axis=AXIS)
)


@dataclass
class Stage:
    """Turns at once; `fault_at` is the turn that fails."""

    fault_at: int | None = None
    did: list[object] = field(default_factory=list)

    def start(self) -> None:
        self.did.append("start")

    def turn_to(self, angle: float) -> float:
        if len([done for done in self.did if isinstance(done, float)]) == self.fault_at:
            raise DeviceError("stuck", "free it")
        self.did.append(angle)
        return angle % 360.0

    def finish(self) -> None:
        self.did.append("finish")


@pytest.fixture
def stage(monkeypatch, scanner) -> Stage:
    """The stage that every configuration opens, with the stand-in scanner behind it."""
    stage = Stage()

    @contextmanager
    def opened(config, *, model, port, relative) -> Iterator[tuple[object, Stage]]:
        assert (model, port, relative) == ("MMC-2", "/dev/ttyUSB0", False)
        try:
            with scanner:
                yield scanner, stage
        finally:
            stage.did.append("stop")

    monkeypatch.setattr(turntable.drivers, "open_turntable", opened)
    return stage


@pytest.fixture
def merged(monkeypatch) -> list[tuple[list[RangeScan], list[float], RotationAxis]]:
    """What the merger was asked for; it gives the first view, and says that the second did not fit."""
    asked = []

    def merge(scans, turns, axis):
        asked.append((list(scans), list(turns), axis))
        return MergedViews(scans[0], 0, (ViewReport(0.0, 0.0, 0.0, 0), ViewReport(90.0, 1.0, 0.0, 0, "it moved")))

    monkeypatch.setattr(turntable, "merge_views", merge)
    return asked


def test_views_are_taken_kept_merged_and_restored(tmp_path, library, stage, merged) -> None:
    outcome = scan_views(CONFIG, Destination(tmp_path), RunOptions(), turns=4)
    assert stage.did == ["start", 0.0, 90.0, 180.0, 270.0, "finish", "stop"]
    ((scans, turns, axis),) = merged
    assert (len(scans), turns) == (4, [0.0, 90.0, 180.0, 270.0])
    np.testing.assert_array_equal(axis.direction, [0.0, 0.0, 1.0])
    views = [f"page-view-{number}.scan" for number in (1, 2, 3, 4)]
    assert {path.name for path in tmp_path.iterdir()} == {*views, "page.scan", "page.png", "page.json"}
    assert load_scan(tmp_path / views[2]).provenance["turntable"]["deg"] == 180.0
    assert [one["text"] for one in outcome.report["findings"]] == ["the view at 90° is not used: it moved"]
    assert [Path(path).name for path in outcome.report["views"]] == views


@pytest.mark.parametrize("merges", [False, True])
def test_what_was_captured_before_a_fault_is_kept_and_reported(tmp_path, library, stage, merged, merges) -> None:
    stage.fault_at = 2 if merges else 1
    with pytest.raises(DeviceError, match="stuck") as reported:
        scan_views(CONFIG, Destination(tmp_path), RunOptions(), turns=3)
    kept = sorted(path.name for path in tmp_path.iterdir())
    assert kept == [f"page-view-{number}.scan" for number in range(1, stage.fault_at + 1)]
    assert stage.did[-1] == "stop"
    assert f"{stage.fault_at} views are safe" in reported.value.__notes__[0]
    assert ("planish merge" if merges else "planish restore") in reported.value.__notes__[0]


def test_stored_views_are_merged_as_they_would_have_been(tmp_path, library, stage, merged) -> None:
    scan_views(CONFIG, Destination(tmp_path), RunOptions(), turns=2)
    folders = [tmp_path / f"page-view-{number}.scan" for number in (1, 2)]
    merge_files(folders, Destination(tmp_path / "again"), RunOptions(CONFIG.restore))
    first, again = merged
    assert first[1] == again[1]
    np.testing.assert_array_equal(first[2].point, again[2].point)
    np.testing.assert_array_equal(first[0][1].points, again[0][1].points)
    assert (tmp_path / "again" / "page.png").exists()


def test_only_views_of_a_stage_can_be_merged(tmp_path, library, stage, merged) -> None:
    scan_views(CONFIG, Destination(tmp_path), RunOptions(), turns=2)
    lone = load_scan(tmp_path / "page-view-1.scan")
    turntable.save_scan(replace(lone, provenance={}), tmp_path / "lone.scan")
    with pytest.raises(BadInput, match="not a view"):
        merge_files([tmp_path / "lone.scan"], Destination(tmp_path / "again"), RunOptions(CONFIG.restore))


def test_nothing_moves_before_it_is_sure_that_nothing_is_overwritten(tmp_path, library, stage, merged) -> None:
    (tmp_path / "page-view-2.scan").mkdir(parents=True)
    with pytest.raises(OverwriteError):
        scan_views(CONFIG, Destination(tmp_path), RunOptions(), turns=2)
    assert stage.did == []


@pytest.mark.parametrize(
    ("stage_settings", "missing"), [(None, "no turntable"), (TurntableSettings(model="MMC-2", port="x"), "axis is")]
)
def test_a_turntable_and_its_axis_are_required(tmp_path, stage_settings, missing) -> None:
    config = CONFIG.model_copy(update={"turntable": stage_settings})
    with pytest.raises(UsageError, match=missing):
        scan_views(config, Destination(tmp_path / "out"), RunOptions(), turns=2)
    assert not (tmp_path / "out").exists()


def test_views_go_round_or_to_both_sides() -> None:
    assert view_angles(4, 360.0) == [0.0, 90.0, 180.0, 270.0]
    assert view_angles(3, 60.0) == [0.0, 30.0, -30.0]
    assert view_angles(2, 40.0) == [0.0, 40.0]


def test_the_axis_is_written_as_the_configuration_reads_it() -> None:
    axis = RotationAxis(np.array([1.25, -3.5, -915.125]), np.array([0.6, 0.0, 0.8]))
    read = AxisSettings.model_validate(tomllib.loads(axis_table(axis, 0.1))["turntable"]["axis"])
    assert read.point_mm == pytest.approx((1.25, -3.5, -915.125), rel=DIGITS)
    assert read.direction == pytest.approx((0.6, 0.0, 0.8), rel=DIGITS)


def test_a_simulated_scanner_and_a_real_stage_are_refused(tmp_path, capsys, repository) -> None:
    text = (repository / "configs/simulated-turntable.toml").read_text()
    (tmp_path / "mixed.toml").write_text(text.replace('port = "simulated"', 'port = "/dev/ttyS99"'))
    assert main(["scan", "--config", str(tmp_path / "mixed.toml"), "--views", "2", "-o", str(tmp_path / "out")]) == 2
    assert "do not see each other" in capsys.readouterr().err


def test_a_direction_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match="no length"):
        AxisSettings(point_mm=(0, 0, 0), direction=(0, 0, 0))


def test_a_simulated_stage_stands_before_a_simulated_scanner_only(repository) -> None:
    table = tomllib.loads((repository / "configs/simulated-turntable.toml").read_text())
    with drivers.open_turntable(table["scanner"], model="ZETA6104", port="simulated") as (_, stage):
        stage.start()
        assert stage.turn_to(120.0) == pytest.approx(120.0)
    with (
        pytest.raises(drivers.SettingsError, match="do not see"),
        drivers.open_turntable({"driver": "vivid900"}, model="MMC-2", port="simulated"),
    ):
        pass


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="two merged views of a gutter are strained by 1.6 % rms")
def test_a_book_that_shadows_itself_is_restored_whole(tmp_path, repository) -> None:
    config = str(repository / "configs/simulated-turntable.toml")
    assert main(["scan", "--config", config, "--views", "2", "-o", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "page.json").read_text())
    assert report["page_mm"] == pytest.approx((200.0, 240.0), abs=0.7)
    assert report["findings"] == []
    views = [str(tmp_path / f"page-view-{number}.scan") for number in (1, 2)]
    assert main(["merge", *views, "-o", str(tmp_path / "again")]) == 0
    assert (tmp_path / "again" / "page.scan").is_dir()

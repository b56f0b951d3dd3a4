"""Several sheets in one mesh, restored by the library itself."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from drivers.simulated import Spread, Text, shoot
from restore import save_scan
from restore.errors import BadInput
from restore.formats import write_obj
from restore.scan import RangeScan, SurfaceMesh
from station.choices import Sheets
from station.cli import main
from station.run.pieces import select_sheets
from station.session.derivation.restoration import run_restore
from station.session.terms.presets import load_preset
from station.verdict.checks import check_measures
from station.verdict.measures import left_out_fraction

LEFT_MM, RIGHT_MM = (105.0, 140.0), (90.0, 130.0)
GAP_MM = 60.0
CHORDS_MM = 0.2  # a curl of 150 mm radius sampled every 15 mm


def curl(width, height, left):
    across, down = np.meshgrid(np.linspace(0, width, 8), np.linspace(height, 0, 10))
    angle = (across - width / 2) / 150.0
    vertices = np.stack([150.0 * np.sin(angle) + width / 2 + left, down, 150.0 * np.cos(angle) - 900.0], axis=-1)
    index = np.arange(80).reshape(10, 8)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    return vertices.reshape(-1, 3), faces


@pytest.fixture
def two_sheets(tmp_path):
    """An OBJ of a sheet of RIGHT_MM and, to its left, one of LEFT_MM."""
    (right, faces), (left, others) = curl(*RIGHT_MM, LEFT_MM[0] + GAP_MM), curl(*LEFT_MM, 0.0)
    path = tmp_path / "page.obj"
    write_obj(SurfaceMesh(np.concatenate([right, left]), np.concatenate([faces, others + len(right)])), path)
    return path


def restored(path, out, *options):
    assert main(["restore", str(path), "-o", str(out), "--dpi", "50", *options]) == 0
    return {file.stem: json.loads(file.read_text()) for file in sorted(out.glob("*.json"))}


@pytest.mark.parametrize("options", [[], ["--sheets", "separate"]])
def test_every_sheet_is_a_page_left_to_right(two_sheets, tmp_path, options):
    reports = restored(two_sheets, tmp_path / "out", *options)
    assert sorted(path.name for path in (tmp_path / "out").glob("*.png")) == ["page-1.png", "page-2.png"]
    np.testing.assert_allclose(reports["page-1"]["page_mm"], LEFT_MM, atol=CHORDS_MM)
    np.testing.assert_allclose(reports["page-2"]["page_mm"], RIGHT_MM, atol=CHORDS_MM)
    assert reports["page-2"]["sheet"] == {"number": 2, "of": 2}
    assert reports["page-2"]["files"] == ["page-2.png", "page-2.json"]


def test_the_largest_is_the_page_with_a_warning(two_sheets, tmp_path):
    reports = restored(two_sheets, tmp_path / "out", "--sheets", "largest")
    np.testing.assert_allclose(reports["page"]["page_mm"], LEFT_MM, atol=CHORDS_MM)
    (found,) = (one for one in reports["page"]["findings"] if one["code"] == "large_sheet_left_out")
    assert (found["severity"], "80% as large" in found["text"]) == ("doubt", True)


@pytest.fixture
def hidden_gutter(tmp_path):
    """A scan folder of an opened book whose gutter gave no range."""
    scan, truth = shoot(Spread(reach_mm=20), Text(), page_mm=(220.0, 160.0), mode="fast")
    hidden = np.abs(truth.flat[..., 0] - 110.0) < 12.0
    save_scan(replace(scan, points=np.where(hidden[..., None], np.nan, scan.points)), tmp_path / "book.scan")
    return tmp_path / "book.scan"


def test_both_leaves_of_a_hidden_gutter_are_pages(hidden_gutter, tmp_path):
    reports = restored(hidden_gutter, tmp_path / "out")
    assert sorted(reports) == ["book-left", "book-right"]
    for side in ("left", "right"):
        report = reports[f"book-{side}"]
        assert report["part"] == side
        np.testing.assert_allclose(report["page_mm"], (98.0, 160.0), atol=1.0)
        assert not [one for one in report["findings"] if "sheet" in one["code"]]
    restored(hidden_gutter, tmp_path / "out", "--sheets", "largest", "--force")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["book.json", "book.png"]


@pytest.mark.parametrize("edits", [None, {"layout": "whole", "parts": {"page": {"rotate_deg": 1.0}}}])
def test_a_session_of_single_pages_loses_no_half_of_a_book(hidden_gutter, tmp_path, edits):
    parameters = {"settings": {"points": 300, "dpi": 50}, "edits": edits}
    run = run_restore(hidden_gutter, parameters, tmp_path / "made")
    assert list(run.result["parts"]) == ["left", "right"]
    for report in run.result["parts"].values():
        assert report["measures"]["left_out_fraction"] == 0.0
        codes = [one["code"] for one in report["findings"]]
        assert ("gutter_hidden" in codes, "part_not_found" in codes) == (edits is not None, edits is not None)


def test_a_page_is_red_when_a_sheet_as_large_is_left_out(hidden_gutter, tmp_path):
    report = restored(hidden_gutter, tmp_path / "out", "--sheets", "largest")["book"]
    measures = {"left_out_fraction": left_out_fraction(report), "fingerprint": ""}
    assert measures["left_out_fraction"] == pytest.approx(1.0, abs=0.05)
    assert check_measures(measures, load_preset("book").thresholds, {})[0] == "red"


def test_together_they_are_one_picture_with_a_warning(two_sheets, tmp_path):
    reports = restored(two_sheets, tmp_path / "out", "--sheets", "together")
    assert reports["page"]["page_mm"][0] > LEFT_MM[0] + RIGHT_MM[0]
    assert any("2 pieces" in one["text"] for one in reports["page"]["findings"])


def test_results_of_an_earlier_choice_go_with_the_new_ones(two_sheets, tmp_path):
    """Those of another scan of such a name stay."""
    out = tmp_path / "out"
    restored(two_sheets, out, "--tiff")
    (out / "page-3.json").write_text(json.dumps({"scan": "elsewhere", "sheet": {}, "files": ["page-3.png"]}))
    (out / "page-3.png").write_bytes(b"mine")
    restored(two_sheets, out, "--sheets", "largest", "--force")
    assert sorted(path.name for path in out.iterdir()) == ["page-3.json", "page-3.png", "page.json", "page.png"]
    restored(two_sheets, out, "--force")
    names = sorted(path.name for path in out.iterdir())
    assert names == ["page-1.json", "page-1.png", "page-2.json", "page-2.png", "page-3.json", "page-3.png"]


def test_a_page_that_is_there_is_not_overwritten(two_sheets, tmp_path, capsys):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "page-2.png").write_bytes(b"mine")
    assert main(["restore", str(two_sheets), "-o", str(tmp_path / "out")]) == 2
    assert "page-2.png" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["page-2.png"]


def test_json_lists_the_report_of_every_page(two_sheets, tmp_path, capsys):
    restored(two_sheets, tmp_path / "out", "--json")
    printed = json.loads(capsys.readouterr().out)
    assert [report["sheet"]["number"] for report in printed["sheets"]] == [1, 2]


def shot_of_two():
    """A shot of two flat sheets of 60 × 30 and 40 × 30 samples, seen by a pinhole camera."""
    cols, rows = np.meshgrid(np.arange(80.0), np.arange(80.0))
    points = np.stack([(cols - 39.5) / 500.0, (39.5 - rows) / 500.0, -np.ones_like(cols)], axis=-1) * 700.0
    seen = (rows >= 10) & (((cols >= 5) & (cols < 35) & (rows < 70)) | ((cols >= 45) & (cols < 75) & (rows < 50)))
    return RangeScan(np.where(seen[..., None], points, np.nan), None, np.stack([cols, rows], axis=-1))


def test_of_a_shot_the_largest_is_the_page_with_a_warning():
    (page,) = select_sheets(shot_of_two(), Sheets.AUTO)
    assert page.scan.measured.sum() == 60 * 30
    assert "67% as large" in page.findings[0].text
    assert [sheet.suffix for sheet in select_sheets(shot_of_two(), Sheets.SEPARATE)] == ["-1", "-2"]


def test_pieces_of_a_shot_cannot_be_packed_together():
    with pytest.raises(BadInput, match="2 pieces cannot be packed"):
        select_sheets(shot_of_two(), Sheets.TOGETHER)


def test_a_piece_that_is_not_a_page_is_left_out_with_its_reason(two_sheets, tmp_path, capsys):
    """A closed surface, such as the weight on a corner, costs the other pieces nothing."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=50.0)
    (right, faces), closed = curl(*RIGHT_MM, 400.0), ball.vertices + (100.0, 60.0, -800.0)
    path = tmp_path / "weighted.obj"
    write_obj(SurfaceMesh(np.concatenate([closed, right]), np.concatenate([ball.faces, faces + len(closed)])), path)
    reports = restored(path, tmp_path / "out", "--sheets", "separate")
    assert list(reports) == ["weighted-2"]
    assert "piece 1 of 2 is skipped: the surface is closed" in capsys.readouterr().out
    restored(path, tmp_path / "again", "--sheets", "separate", "--json")
    (left_out,) = json.loads(capsys.readouterr().out)["rejected"]
    assert (left_out["number"], left_out["of"]) == (1, 2)


def test_pieces_of_which_none_is_a_page_are_an_error(tmp_path, capsys):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=50.0)
    vertices = np.concatenate([ball.vertices, ball.vertices + (200.0, 0.0, 0.0)])
    path = tmp_path / "balls.obj"
    write_obj(SurfaceMesh(vertices, np.concatenate([ball.faces, ball.faces + len(ball.vertices)])), path)
    assert main(["restore", str(path), "-o", str(tmp_path / "out"), "--sheets", "separate"]) == 5
    assert "closed" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()

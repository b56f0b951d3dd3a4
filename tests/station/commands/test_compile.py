"""Kernels are compiled with a small page, which is one."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from restore import Settings, load_scan, restore
from station.cli import main
from station.commands import compile as command
from station.run import one_page
from station.run.small_page import DISTANCE_MM, PITCH, RADIUS_MM, ROWS, small_page

ROUNDING_MM = 1e-9  # of sums of squares near 10⁶ mm² in double precision


def test_the_page_is_a_cylinder_seen_along_lines_of_sight():
    scan = small_page()
    x, _, z = np.moveaxis(scan.points, 2, 0)
    axis_mm = -DISTANCE_MM - RADIUS_MM
    np.testing.assert_allclose(np.hypot(x, z - axis_mm), RADIUS_MM, atol=ROUNDING_MM)
    tangents = scan.points[..., :2] / -scan.points[..., 2:]
    np.testing.assert_allclose(np.diff(tangents[..., 0], axis=1), PITCH)
    np.testing.assert_allclose(np.diff(tangents[..., 1], axis=0), -PITCH)


def test_it_is_restored_whole_without_libraries_of_the_system(monkeypatch):
    for name in ("open3d", "pymeshlab"):
        monkeypatch.setitem(sys.modules, name, None)
    page = restore(small_page(), Settings(points=command.POINTS))
    width = 2 * RADIUS_MM * np.arcsin(np.ptp(small_page().points[..., 0]) / 2 / RADIUS_MM)
    sample = PITCH * DISTANCE_MM
    assert page.report["page_mm"][0] == pytest.approx(width, abs=2 * sample)  # the border may be one beyond each side


def test_the_page_is_restored_as_a_scan_and_as_the_mesh_that_it_leaves(monkeypatch):
    runs = []

    def restore_file(source, _destination, options):
        runs.append((options.settings.method, source.name))
        if source.name == "page.scan":
            assert len(load_scan(source).points) == ROWS
            assert "mesh" in options.outputs

    monkeypatch.setattr(one_page, "restore_file", restore_file)
    assert command.compile_kernels() == 0
    assert runs == [("isometric", "page.scan"), ("isometric", "page-warped.obj")]


@pytest.mark.parametrize(("count", "reported"), [(0, "compiled already"), (7, "7 functions compiled")])
def test_the_command_says_what_it_did(monkeypatch, capsys, count, reported):
    monkeypatch.setattr(command, "compile_kernels", lambda: count)
    assert main(["compile"]) == 0
    assert reported in capsys.readouterr().out

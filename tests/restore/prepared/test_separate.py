"""Several sheets in one scan are told apart."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from restore import Settings, restore
from restore.errors import BadInput
from restore.mesh.measures import surface_area
from restore.mesh.ordered_grid import GridMesh
from restore.prepared.separate import _near_boxes, separate_sheets
from restore.scan import SurfaceMesh

SPACING_MM = 7.0
ROUNDING = 1e-9  # relative, of sums of areas


def sheet(width=105.0, height=140.0, *, at=0.0, keep=None):
    """A curl about a vertical axis with a point every SPACING_MM, its left side at x = at mm as the scanner sees it.

    keep(x, y) chooses the points (n,) that stay, x and y in mm on the flat sheet.
    """
    cols, rows = round(width / SPACING_MM) + 1, round(height / SPACING_MM) + 1
    across, down = np.meshgrid(np.linspace(0, width, cols), np.linspace(height, 0, rows))
    angle = (across - width / 2) / 150.0
    vertices = np.stack([150.0 * np.sin(angle) + width / 2 + at, down, 150.0 * np.cos(angle) - 900.0], axis=-1)
    index = np.arange(rows * cols).reshape(rows, cols)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, c, d), (a, d, b))])
    if keep is not None:
        faces = faces[keep(across.ravel(), down.ravel())[faces].all(axis=1)]
    return SurfaceMesh(vertices.reshape(-1, 3), faces)


def together(*meshes):
    """The meshes as one, in that order."""
    firsts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + first for mesh, first in zip(meshes, firsts[:-1], strict=True)]
    return SurfaceMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def test_sheets_come_left_to_right_each_by_itself():
    right, left = sheet(90.0, at=300.0), sheet(at=0.0)
    found = separate_sheets(together(right, left))
    assert [np.floor(part.scan.vertices[:, 0].min()) >= 300.0 for part in found] == [False, True]
    for part, alone in zip(found, (left, right), strict=True):
        assert len(part.scan.vertices) == len(alone.vertices)
        assert part.size == pytest.approx(surface_area(alone.vertices, alone.faces), rel=ROUNDING)


def test_left_and_right_are_those_of_the_scanner_when_the_mesh_is_turned_upside_down():
    turn = np.diag([-1.0, -1.0, 1.0])
    mesh = together(sheet(90.0, at=300.0), sheet(at=0.0))
    found = separate_sheets(replace(mesh, vertices=mesh.vertices @ turn))
    assert [len(part.scan.vertices) for part in found] == [len(sheet(90.0).vertices), len(sheet().vertices)]


def test_one_sheet_is_the_scan_itself():
    mesh = sheet()
    (only,) = separate_sheets(mesh)
    assert only.scan is mesh


def test_pieces_on_both_sides_of_a_gap_of_drop_outs_are_one_sheet():
    (only,) = separate_sheets(sheet(keep=lambda x, _: np.abs(x - 52.5) > SPACING_MM))
    assert only.size < surface_area(sheet().vertices, sheet().faces)


def test_only_pieces_whose_boxes_come_near_are_compared():
    rng = np.random.default_rng(0)
    borders = [cKDTree(rng.uniform(0, 5, (4, 3)) + rng.uniform(0, 60, 3)) for _ in range(60)]
    gap = [[np.maximum(a.mins - b.maxes, b.mins - a.maxes).max() for b in borders] for a in borders]
    expected = [(a, b) for a in range(60) for b in range(a + 1, 60) if gap[a][b] < 3.0]
    assert list(_near_boxes(borders, 3.0)) == expected != []


def test_debris_is_not_a_sheet():
    scrap = replace(sheet(14.0, 7.0), vertices=sheet(14.0, 7.0).vertices + [300.0, 0, 0])
    assert len(separate_sheets(together(sheet(210.0, 280.0), scrap))) == 1


def test_a_fragment_is_not_a_rectangle_and_a_sheet_is():
    assert [one.is_rectangular for one in separate_sheets(sheet())] == [True]
    assert [one.is_rectangular for one in separate_sheets(sheet(keep=lambda x, y: y > 0.8 * x))] == [False]


def test_sheets_of_a_shot_are_distinguished_by_the_samples(camera):
    rows, cols = (grid.astype(int) for grid in camera.indices)
    areas = [(cols > 10) & (cols < 90) & (rows > 20) & (rows < 140), (cols > 110) & (cols < 180) & (rows > 40)]
    scan = camera.shot(np.where(areas[0] | areas[1], camera.plane(), np.nan))
    left, right = separate_sheets(scan)
    for part, area in ((left, areas[0]), (right, areas[1])):
        np.testing.assert_array_equal(part.scan.measured, area)
        assert part.size == area.sum()
        assert part.is_rectangular


def test_an_ordered_grid_is_one_sheet_also_over_gaps():
    one = together(sheet(), sheet(at=200.0))
    grid = GridMesh(one.vertices, one.faces, shape=(1, len(one.vertices)), places=np.arange(len(one.vertices)))
    assert len(separate_sheets(one)) == 2
    assert [found.scan for found in separate_sheets(grid)] == [grid]


def test_a_scan_without_lines_of_sight_is_one_sheet_and_stays_a_scan(camera):
    """It is one shot still, which a mesh would not be."""
    scan = camera.shot(camera.plane())
    merged = replace(scan, points=scan.points[:, ::-1] * [-1.0, 1.0, 1.0], texture_xy=np.zeros_like(scan.texture_xy))
    (one,) = separate_sheets(merged)
    assert one.scan is merged


def test_one_sheet_in_a_shot_is_the_shot_itself(camera):
    scan = camera.shot(camera.plane())
    assert separate_sheets(scan)[0].scan is scan


def test_what_a_table_warns_of_is_reported_with_its_sheet(camera):
    """A page of the table's colour, whose left side lies on it."""
    rows, cols = camera.indices
    page = (rows >= 35) & (rows < 125) & (cols >= 40) & (cols < 160)
    height = np.where(page, 0.02 * np.maximum(cols - 40.0, 0.0) ** 1.5, 0.0)
    noise = np.random.default_rng(0).normal(0.0, camera.noise, camera.shape)
    white = np.full((*camera.shape, 3), 230, np.uint8)
    (one,) = separate_sheets(camera.shot(1.0 / (1.0 / camera.plane() - height) + noise, white))
    (found,) = one.segmented.scan.findings
    assert "outline touches the table" in found.text
    assert one.scan is one.segmented.scan
    assert not (one.segmented.table & one.segmented.samples).any()


def test_restore_lays_all_pieces_in_one_picture_with_a_warning():
    page = restore(together(sheet(), sheet(at=200.0)), Settings(dpi=50))
    assert any("2 pieces" in one["text"] for one in page.report["findings"])
    assert page.report["page_mm"][0] > 300.0
    alone = restore(sheet(), Settings(dpi=50))
    assert not any("pieces" in one["text"] for one in alone.report["findings"])


def test_a_broken_mesh_is_refused():
    with pytest.raises(BadInput, match="does not have"):
        separate_sheets(SurfaceMesh(np.zeros((3, 3)), np.array([[0, 1, 7]])))

"""A page ends where its table is measured through it, and goes on where nothing was measured."""

from dataclasses import replace

import numpy as np
import pytest

from drivers.simulated import Markers, Wave
from drivers.simulated.imaging.shot import printed, shoot_scene
from drivers.simulated.scene.scene import place_sheet
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import FAST, LENSES
from restore import Settings, restore
from restore.mesh.ordered_grid import grid_faces
from restore.prepared.prepare import prepare
from restore.scan import SurfaceMesh

PAGE_MM = (240.0, 170.0)
MIDDLE_MM, RADIUS_MM = np.array([120.0, 95.0]), 16.0
DPI = 60
RIM_MM = 4.0  # about a hole: a sample of the fast mode is a millimetre wide, and the side above may be off by two


def shot(*, holed, gap_mm=3.0):
    """A shot of a wavy page above a light table, with a hole through it or without."""
    lens = LENSES["MIDDLE"]
    art = printed(Markers(), PAGE_MM)
    scene = place_sheet(Wave(), art, depth_mm=900.0 + lens.pupil_mm, table="light", gap_mm=gap_mm)
    away = np.linalg.norm(scene.page_uv[scene.faces].mean(axis=1) - MIDDLE_MM, axis=1)
    kept = ~scene.on_page | (away > (RADIUS_MM if holed else 0.0))
    scene = replace(scene, faces=scene.faces[kept], on_page=scene.on_page[kept])
    return shoot_scene(scene, nominal(lens), FAST, 900.0, np.random.default_rng(0))


def from_hole(shape):
    """(h, w) mm from the middle of the hole to the pixels of a page."""
    y, x = np.indices(shape)
    return np.hypot((x + 0.5) * 25.4 / DPI - MIDDLE_MM[0], PAGE_MM[1] - (y + 0.5) * 25.4 / DPI - MIDDLE_MM[1])


def as_mesh(scan):
    """All that was measured as one surface, from page to table, moved off the rays of the scanner."""
    measured = scan.measured
    tilt = np.array([[1, 0, 0], [0, np.cos(0.1), -np.sin(0.1)], [0, np.sin(0.1), np.cos(0.1)]])
    return SurfaceMesh(scan.points[measured] @ tilt.T, grid_faces(measured), scan.texture_xy[measured], scan.texture)


@pytest.fixture(scope="module")
def holed():
    return shot(holed=True)[0]


@pytest.mark.slow
@pytest.mark.parametrize("form", [lambda scan: scan, as_mesh], ids=["range image", "mesh"])
def test_the_page_ends_at_a_hole(holed, form):
    page = restore(form(holed), Settings(dpi=DPI))
    away = from_hole(page.mask.shape)
    hole, paper = away < RADIUS_MM - RIM_MM, (away > RADIUS_MM + RIM_MM) & (away < 2 * RADIUS_MM)
    assert not page.mask[hole].any()
    assert (page.image[hole] == 255).all() and (page.master[hole] == 255).all()
    assert np.isnan(page.page_map[hole]).all()
    assert page.mask[paper].all()
    area = np.pi * RADIUS_MM**2
    (found,) = [one for one in page.findings if one.code == "holes"]
    assert abs(float(found.text.split(" mm²")[0].split()[-1]) - area) < 2 * np.pi * RADIUS_MM * RIM_MM


def test_drop_outs_are_not_holes():
    scan, truth = shot(holed=False)
    lost = np.linalg.norm(truth.flat - MIDDLE_MM, axis=2) < RADIUS_MM
    points = np.where(lost[..., None], np.nan, scan.points)
    page = restore(replace(scan, points=points), Settings(dpi=DPI))
    assert page.mask[from_hole(page.mask.shape) < RADIUS_MM].all()
    assert not any("holes" in one["text"] for one in page.report["findings"])


def island(truth):
    """(rows, cols, 1) True where the hole would be."""
    return (np.linalg.norm(truth.flat - MIDDLE_MM, axis=2) < RADIUS_MM)[..., None]


def test_deeper_samples_that_are_not_table_are_not_holes():
    scan, truth = shot(holed=False)
    deeper = scan.points * (1.0 + 40.0 / 900.0)  # beyond the table
    assert not prepare(replace(scan, points=np.where(island(truth), deeper, scan.points))).sheet.holes.any()


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.15])
def test_samples_between_page_and_table_are_not_holes(share):
    """Samples beside dark ink may be off by millimetres, nearer to the table than to the paper."""
    scan, truth = shot(holed=False, gap_mm=20.0)
    behind = shot(holed=True, gap_mm=20.0)[0].points
    between = behind + share * (scan.points - behind)
    holes = prepare(replace(scan, points=np.where(island(truth), between, scan.points))).sheet.holes
    assert holes.any() == (share == 0.0)

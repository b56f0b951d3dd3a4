"""The whole pipeline on the simulated scanner, with pages whose flat truth is known to the micrometre."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivers.simulated import Figure, Flat, MultiFold, Pose, Truth, White, shoot
from drivers.vivid900.geometry.calibration import nominal
from drivers.vivid900.geometry.lenses import LENSES
from oracles.layout import layout_error
from oracles.markers import MarkerError, marker_error, rigid_residual
from oracles.sheets import CASES
from restore import (
    BadInput,
    NotEnoughSurface,
    RangeScan,
    RestoredPage,
    Settings,
    SurfaceMesh,
    flatten,
    load_scan,
    restore,
    separate_sheets,
)
from restore.formats import write_abs, write_obj, write_ply, write_vrml
from restore.mesh.ordered_grid import grid_faces
from restore.mesh.triangulate import triangulate
from restore.texture.coverage import CoverageClass, cropped_fraction
from restore.texture.page import MM_PER_INCH

SIZE_TOLERANCE = 0.001  # of the page: the outline is known to a quarter of a sample, 0.12 mm, on either side
# Both edges of a page to a sixth of a sample, where its samples lie 0.47 mm apart, and half a pixel of the picture.
EDGES_MM = 0.25
OWN_COLOUR_MM = 0.1  # a fifth of a sample: of the edge the picture shows next to nothing
DARK_MM = 0.5  # anywhere on the page; a length over noise of one sample would be off by more
FILLED = 0.99  # of the picture is page: a corner that the scanner lost is white
STRAIGHT_MM = 0.05  # a fifteenth of the spacing: sides cross the rows of the view that a mesh is sampled by
ROUNDED_CODES = 1
FLAT_TOLERANCE_MM = 0.02  # noise of 0.035 mm a sample, averaged over windows of 49
# Two ways to the same page: coordinates in the files are rounded to 0.01 mm, less than the scanner's noise.
SAME_PAGE_MM = 0.1
# Another pose is another noise and another sampling: the error itself may differ by half of its limit.
POSE_SPREAD_MM = 0.06


# The sheets that are restored in every run: smooth, creased, and flat.
USUAL = ("curl", "multi-fold", "flat")
EACH = [pytest.param(name, marks=() if name in USUAL else pytest.mark.slow) for name in CASES]


@cache
def shot(name: str, *, tilt: float = 3.0, turn: float = 0.0, shift: tuple = (0.0, 0.0, 0.0), mode: str = "fine"):
    pose = Pose(tilt_deg=tilt, turn_deg=turn, shift_mm=shift)
    return shoot(CASES[name].sheet, seed=11, pose=pose, mode=mode)


@cache
def page(name: str, **pose) -> RestoredPage:
    return restore(shot(name, **pose)[0], Settings())


def error(page: RestoredPage, truth: Truth) -> MarkerError:
    return marker_error(page.image, page.dpi, truth.markers)


@pytest.mark.parametrize("name", EACH)
def test_marker_page(name):
    truth, restored = shot(name)[1], page(name)
    measured = error(restored, truth)
    assert measured.found == measured.of
    assert not measured.mirrored
    assert measured.rms_mm <= CASES[name].limit_mm
    assert restored.report["page_mm"] == pytest.approx(truth.page_mm, rel=SIZE_TOLERANCE)
    assert restored.report["flipped_faces"] == 0
    assert restored.report["points"] == pytest.approx(1000, rel=0.05)


@pytest.mark.parametrize("mode", ["fast", pytest.param("fine", marks=pytest.mark.slow)])
def test_a_page_that_leaves_the_picture_is_said_to(mode):
    scan, _ = shoot(Flat(), mode=mode, page_mm=(200.0, 150.0), pose=Pose(shift_mm=(100.0, 0.0, 0.0)))
    (found,) = restore(scan, Settings(points=300, dpi=100)).report["findings"]
    assert "at the edge of the image" in found["text"]


@pytest.mark.parametrize("name", EACH)
def test_the_picture_is_the_page_from_edge_to_edge(name):
    truth, restored = shot(name)[1], page(name)
    picture = np.array(restored.image.shape[1::-1]) * MM_PER_INCH / restored.dpi
    np.testing.assert_allclose(picture, truth.page_mm, atol=EDGES_MM)
    assert restored.mask.mean() > FILLED


@pytest.mark.parametrize("dpi", [37, *(pytest.param(dpi, marks=pytest.mark.slow) for dpi in (30, 50))])
def test_a_page_coarser_than_its_source(dpi):
    truth, restored = shot("flat")[1], restore(shot("flat")[0], Settings(dpi=dpi))
    assert restored.image.shape[:2] == restored.mask.shape == restored.coverage.shape
    picture = np.array(restored.image.shape[1::-1]) * MM_PER_INCH / dpi
    np.testing.assert_allclose(picture, truth.page_mm, atol=EDGES_MM + MM_PER_INCH / dpi / 2)


@pytest.mark.slow
def test_lens_distortion_does_not_distort_the_page():
    case, middle = CASES["curl"], nominal(LENSES["MIDDLE"])
    barrel = replace(middle, distortion=(-0.08, 0.1))  # 1.3 pixels in the corners, as of a plain C-mount lens
    scan, truth = shoot(case.sheet, seed=11, pose=Pose(tilt_deg=3.0), body=barrel)
    assert error(restore(scan, Settings()), truth).rms_mm <= case.limit_mm


def test_the_measure_can_fail():
    truth = shot("curl")[1]
    stretched = replace(page("curl"), dpi=150 / 1.01)  # a page one per cent too large
    assert error(stretched, truth).rms_mm > 4 * CASES["curl"].limit_mm
    assert error(stretched.with_pictures(image=stretched.image[:, ::-1]), truth).mirrored


@pytest.mark.parametrize("name", [pytest.param("curl", marks=pytest.mark.slow), "multi-fold"])
@pytest.mark.parametrize(
    "pose",
    [
        pytest.param({"tilt": 0.0, "turn": 8.0}, marks=pytest.mark.slow),
        pytest.param({"tilt": 6.0, "shift": (3.0, -4.0, 10.0)}, marks=pytest.mark.slow),
        {"tilt": -5.0, "turn": -4.0, "shift": (0.0, 0.0, -15.0)},
    ],
    ids=["turned", "tilted and moved", "all"],
)
def test_the_page_does_not_depend_on_the_pose_of_the_sheet(name, pose):
    measured = error(page(name, **pose), shot(name, **pose)[1])
    assert measured.rms_mm <= CASES[name].limit_mm
    assert abs(measured.rms_mm - error(page(name), shot(name)[1]).rms_mm) < POSE_SPREAD_MM


@pytest.mark.parametrize("name", ["wave", pytest.param("multi-fold", marks=pytest.mark.slow)])
def test_a_page_on_a_table_of_its_own_colour_has_its_size(name):
    scan, truth = shoot(CASES[name].sheet, seed=5, pose=Pose(tilt_deg=2.0, turn_deg=3.0), table="white")
    report = restore(scan).report
    np.testing.assert_allclose(report["page_mm"], truth.page_mm, atol=OWN_COLOUR_MM)
    assert report["findings"] == []


@pytest.mark.slow
def test_a_dark_picture_on_a_page_bends_nothing():
    """Of its lower part, hills in the dark, the laser gets one sample in eight back."""
    scan, truth = shoot(CASES["wave"].sheet, Figure(), seed=5, pose=Pose(tilt_deg=-8.0))
    page = restore(scan)
    error = np.linalg.norm(layout_error(page, scan, truth), axis=1)
    assert error.max() < DARK_MM
    assert page.report["findings"] == []


def test_a_flat_sheet_stays_flat_and_at_its_place():
    scan, truth = shoot(Flat(), seed=2, table="none")
    restored = restore(scan)
    inner = restored.flat.texcoords[:, ::-1]
    known = truth.flat[tuple(np.round(inner).astype(int).T)]
    on_sample = np.isfinite(known).all(axis=1)
    # The flat page lies where the scanner saw it: in the scanner's x and y, up to the turn that squares it.
    rest, scale = rigid_residual(restored.flat.flat[on_sample], restored.flat.vertices[on_sample, :2])
    assert np.sqrt((rest**2).sum(axis=1).mean()) < FLAT_TOLERANCE_MM
    assert scale == pytest.approx(1.0, abs=2e-4)
    assert np.abs(restored.flat.flat.mean(axis=0) - restored.flat.vertices[:, :2].mean(axis=0)).max() < 1.0


def test_two_runs_give_the_same_bytes():
    scan = shot("curl")[0]
    first, second = restore(scan), page("curl")
    assert first.image.tobytes() == second.image.tobytes()
    assert first.flat.flat.tobytes() == second.flat.flat.tobytes()


WRITERS = {"page.abs": write_abs, "page.wrl": write_vrml, "mesh.obj": write_obj, "mesh.ply": write_ply}


@pytest.mark.parametrize("name", ["page.abs", *(pytest.param(n, marks=pytest.mark.slow) for n in list(WRITERS)[1:])])
def test_every_format_gives_the_same_page(tmp_path, name):
    scan, truth = shot("curl")
    WRITERS[name](scan if name.startswith("page") else triangulate(scan), tmp_path / name)
    reference = page("curl")
    assert reference.flat.texture is not None
    from PIL import Image

    picture = tmp_path / "colour.png"
    Image.fromarray(scan.texture).save(picture)
    other = restore(load_scan(tmp_path / name, picture if name.startswith("page") else None))
    assert error(other, truth).rms_mm <= CASES["curl"].limit_mm
    assert _apart(reference, other) < SAME_PAGE_MM


def _apart(one: RestoredPage, other: RestoredPage) -> float:
    """RMS mm between the places that two pages give the same texture pixels, after a rigid fit."""
    places = []
    for restored in (one, other):
        rows, cols = np.nonzero(restored.mask)
        source = np.round(restored.page_map[rows, cols]).astype(int)
        total, count = np.zeros((480, 640, 2)), np.zeros((480, 640, 1))
        np.add.at(total, (source[:, 1], source[:, 0]), np.stack([cols, -rows], axis=1) * 25.4 / restored.dpi)
        np.add.at(count, (source[:, 1], source[:, 0]), 1.0)
        places.append(np.where(count > 0, total / np.maximum(count, 1), np.nan))
    both = np.isfinite(places[0] + places[1]).all(axis=2)
    rest, _ = rigid_residual(places[0][both], places[1][both])
    return float(np.sqrt((rest**2).sum(axis=1).mean()))


@pytest.mark.slow
def test_fast_mode():
    measured = error(page("multi-fold", mode="fast"), shot("multi-fold", mode="fast")[1])
    assert measured.found == measured.of
    assert measured.rms_mm <= 2 * CASES["multi-fold"].limit_mm  # a quarter of the samples: twice the error at most


@pytest.mark.slow
def test_a_mesh_rotated_in_space_is_restored_as_accurately():
    scan, truth = shoot(MultiFold(), seed=4, table="none")
    mesh = triangulate(scan)
    turn = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]])
    moved = replace(mesh, vertices=(mesh.vertices - mesh.vertices.mean(axis=0)) @ turn.T + [5.0, 900.0, 40.0])
    assert error(restore(moved), truth).rms_mm <= CASES["multi-fold"].limit_mm


def test_every_stage_is_reported():
    report = page("curl").report
    for key in (
        "points",
        "method",
        "dpi",
        "shading",
        "iterations",
        "area_ratio",
        "resolved_ppi",
        "decimation_error_mm",
        "source",
    ):
        assert key in report
    assert set(report["seconds"]) >= {"prepare", "decimate", "flatten", "texture", "shade"}
    assert report["area_ratio"] == pytest.approx(1.0, abs=0.005)
    assert report["resolved_ppi"] == pytest.approx(1942.8 / 900 * 25.4, rel=0.1)
    assert report["decimation_error_mm"]["mean_mm"] < 0.1


def test_progress_and_steps_can_be_followed():
    reported, steps = [], []
    restore(
        shot("curl")[0],
        progress=lambda stage, done: reported.append((stage, done)),
        on_step=lambda step, positions, faces: steps.append((step, positions.shape, len(faces))),
    )
    assert [stage for stage, done in reported if done == 1.0] == [
        "prepare",
        "decimate",
        "flatten",
        "refine",
        "texture",
        "shade",
    ]
    assert [step for step, _, _ in steps] == list(range(1, len(steps) + 1))


@pytest.mark.slow
def test_shading_is_removed_on_request():
    scan, _ = shoot(CASES["curl"].sheet, White(), seed=3)
    kept, removed = (restore(scan, Settings(shading=choice)) for choice in ("keep", "remove"))
    spread = [np.ptp(np.percentile(p.image[p.mask].mean(axis=1), [2, 98])) for p in (kept, removed)]
    assert spread[1] < 0.25 * spread[0]  # a curl has smooth light; what is left is the noise of the colour image
    np.testing.assert_array_equal(removed.master, kept.image)
    np.testing.assert_array_equal(kept.master, kept.image)
    assert kept.report["light"] == {}
    assert removed.report["light"]["unevenness"] < 0.25 * removed.report["light"]["unevenness_before"]


def test_the_light_that_is_removed_is_the_same_at_every_resolution():
    scan = shot("curl")[0]
    coarse, fine = (restore(scan, Settings(shading="remove", dpi=dpi)) for dpi in (40, 200))
    assert coarse.report["light"]["removed"]
    assert coarse.report["light"] == fine.report["light"]


@pytest.mark.slow
def test_bare_paper_is_made_neutral_on_request_and_the_master_keeps_its_colour():
    scan, _ = shoot(CASES["curl"].sheet, White(), seed=3, mode="fast")
    texture = (scan.texture * np.array([1.0, 0.85, 0.7])).astype(np.uint8)
    restored = restore(replace(scan, texture=texture), Settings(white_balance="paper"))
    paper, before = (np.median(picture[restored.mask], axis=0) for picture in (restored.image, restored.master))
    assert np.ptp(before) > 40
    assert np.ptp(paper) <= ROUNDED_CODES
    assert restored.report["white_balance"]["setting"] == "paper"
    assert restored.report["white_balance"]["balanced"]


def test_a_relief_without_colour_keeps_its_shading():
    scan = replace(shot("curl")[0], texture=None)
    image = restore(scan, Settings(shading="remove")).image
    assert np.ptp(image[image < 255]) > 50


@pytest.mark.slow
def test_the_report_has_the_cut_of_the_page_that_its_maps_show():
    scan, restored = shot("curl")[0], page("curl")
    shown, source = restored.coverage != CoverageClass.OUTSIDE, restored.page_map
    cut = cropped_fraction(shown, source.__getitem__, scan.texture.shape[:2])
    assert restored.report["coverage"]["cropped_fraction"] == cut < 0.01
    narrow = replace(scan, points=scan.points[:, 200:], texture_xy=scan.texture_xy[:, 200:] - [200.0, 0.0])
    narrow = replace(narrow, texture=scan.texture[:, 200:])
    assert restore(narrow, Settings(dpi=50)).report["coverage"]["cropped_fraction"] > 0.1
    assert restore(replace(scan, texture=None), Settings(dpi=50)).report["coverage"]["cropped_fraction"] is None


@pytest.mark.slow
def test_a_sheet_of_a_scan_is_the_page_of_the_scan():
    scan = shot("curl")[0]
    (sheet,) = separate_sheets(scan)
    alone, whole = (restore(one, Settings(dpi=50)) for one in (sheet, scan))
    np.testing.assert_array_equal(alone.image, whole.image)
    assert alone.report["source"] == whole.report["source"]


def test_a_bare_table_raises_not_enough_surface():
    points = np.full((480, 640, 3), np.nan)
    scan = RangeScan(points, None, np.zeros((480, 640, 2)))
    with pytest.raises(NotEnoughSurface):
        restore(scan)


def test_flatten_a_scan_that_came_as_a_mesh():
    mesh = page("curl").flat
    assert flatten(mesh).flat == pytest.approx(mesh.flat, abs=5.0)  # chords of 9 mm over a bend of 100 mm, unsquared


@pytest.mark.slow
def test_samples_missed_by_the_laser_but_seen_by_the_camera_are_reported_as_filled():
    scan, _ = shoot(CASES["curl"].sheet, White(), seed=3, mode="fast")
    points = scan.points.copy()
    points[100:112, 150:170] = np.nan
    restored = restore(replace(scan, points=points), Settings(dpi=75))
    hole = restored.coverage[np.hypot(restored.page_map[..., 0] - 319, restored.page_map[..., 1] - 211) < 8]
    assert len(hole) > 10
    assert (hole == CoverageClass.INTERPOLATED).all()
    assert restored.mask[restored.coverage == CoverageClass.INTERPOLATED].all()
    assert restored.report["coverage"]["occluded"] < 0.002


def test_a_scan_in_metres_is_detected_by_its_size():
    scan = shot("flat")[0]
    with pytest.raises(BadInput, match="measures 0") as caught:
        restore(replace(scan, points=scan.points / 1000.0))
    assert "millimetres" in caught.value.hint


@pytest.mark.parametrize("columns", [251, pytest.param(301, marks=pytest.mark.slow)])
def test_a_dense_mesh_that_lies_straight_has_its_size(columns):
    """A curl of 200 × 150 mm with its sides along the axes of its file."""
    across, down = np.meshgrid(np.linspace(0.0, 200.0, columns), np.linspace(150.0, 0.0, columns * 3 // 4))
    points = np.stack([150.0 * np.sin(across / 150.0), down, -150.0 * np.cos(across / 150.0)], axis=-1)
    faces = grid_faces(np.ones(across.shape, bool))
    picture = np.full((300, 400, 3), 235, np.uint8)
    pixels = np.stack([2.0 * across, 300.0 - 2.0 * down], axis=-1).reshape(-1, 2) - 0.5
    restored = restore(SurfaceMesh(points.reshape(-1, 3), faces, pixels, picture), Settings(dpi=50))
    assert restored.report["page_mm"] == pytest.approx((200.0, 150.0), abs=STRAIGHT_MM)

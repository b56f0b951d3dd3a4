"""The pictures: that they show what is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from restore import SurfaceMesh
from restore.mesh.measures import vertex_normals
from restore.texture.coverage import CoverageClass
from station.pictures import view
from station.pictures.frames import COLUMNS, FRAMES, HEIGHT, KEPT, WIDTH, Recorder, frames_sheet
from station.pictures.panels import Panel, resize_to_fit, side_by_side
from station.pictures.review import HATCHES, hatch_unseen, review
from station.pictures.strain import SIGNED, round_up, strain_picture

ROUNDING = 1e-9  # of sums of a few numbers of size 1 to 100
SQUARE = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def test_the_camera_sees_the_page_upright_and_not_mirrored(page):
    vertices = page.flat.vertices
    camera = view.oblique_camera(vertices, azimuth=0)
    seen, depth = camera.project(vertices)
    grid, far = seen.reshape(16, 24, 2), depth.reshape(16, 24)
    assert (np.diff(grid[..., 0], axis=1) > 0).all()  # left to right
    assert (np.diff(grid[..., 1], axis=0) < 0).all()  # top to bottom
    assert far[0].min() > far[-1].min()  # the upper edge is the far one
    assert (far > 0).all()


def test_the_view_shows_the_texture_on_the_front_and_paper_on_the_back(page):
    red = np.zeros_like(page.image)
    red[..., 0] = 255
    mesh = replace(page.flat, texture=red)
    camera = view.oblique_camera(mesh.vertices)

    def red_pixels(mesh: SurfaceMesh) -> int:
        picture = view.render_mesh(mesh, camera, height=90, width=120).astype(int)
        return int((picture[..., 0] > picture[..., 1] + 60).sum())

    front = red_pixels(mesh)
    assert front > 90 * 120 / 5
    assert red_pixels(replace(mesh, faces=mesh.faces[:, ::-1])) < front / 100  # where the page turns away from the eye
    assert red_pixels(replace(mesh, texture=None)) == 0


def test_normals_point_to_the_scanner(page):
    normals = vertex_normals(page.flat.vertices, page.flat.faces)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=ROUNDING)
    assert (normals[:, 2] > 0).all()


def test_review_puts_three_panels_in_a_row(page, scan):
    with_colour, without = review(page, scan.texture), review(page, None)
    assert with_colour.shape[0] == without.shape[0]
    assert with_colour.shape[1] > without.shape[1]


def test_side_by_side_keeps_every_picture_whole():
    pictures = [np.full((40, 30, 3), 250, np.uint8), np.full((20, 50, 3), 5, np.uint8)]
    sheet = side_by_side([Panel(picture, "") for picture in pictures])
    for picture in pictures:
        assert (sheet == picture[0, 0]).all(axis=2).sum() == picture.shape[0] * picture.shape[1]


@pytest.mark.parametrize(("shape", "fitted"), [((480, 640), (75, 100)), ((1000, 10), (80, 1)), ((8, 4), (80, 40))])
def test_fit_keeps_the_proportions(shape, fitted):
    assert resize_to_fit(np.zeros((*shape, 3), np.uint8), height=80, width=100).shape[:2] == fitted


def test_strain_picture_shows_stretch_in_red_and_compression_in_blue(page):
    def mean_colour(factor: float) -> np.ndarray:
        white = np.full_like(page.image, 255)
        stretched = replace(page.fine, flat=page.fine.flat * factor)
        return strain_picture(replace(page.with_pictures(image=white), fine=stretched))[300, 300].astype(float)

    assert np.abs(mean_colour(1.05) - SIGNED[-1]).max() < np.abs(mean_colour(1.05) - SIGNED[0]).max()
    assert np.abs(mean_colour(0.95) - SIGNED[0]).max() < np.abs(mean_colour(0.95) - SIGNED[-1]).max()


@pytest.mark.parametrize(("value", "scale"), [(0.0011, 0.002), (0.002, 0.002), (0.03, 0.05), (7.0, 10.0), (0.0, 1e-6)])
def test_scales_end_in_a_round_number(value, scale):
    assert round_up(value) == pytest.approx(scale)


def recorded(steps: int, height_after=lambda share: 1 - share) -> Recorder:
    recorder = Recorder()
    positions, faces = np.zeros((4, 3)), TWO
    for step in range(1, steps + 1):
        positions[:] = np.column_stack([SQUARE, np.full(4, height_after(step / steps))])
        recorder(step, positions, faces)  # the same array every time, as a solver does
    return recorder


@pytest.mark.parametrize("steps", [1, 2, 7, 8, 9, 40, 1000])
def test_frames_run_from_the_first_step_to_the_last(steps):
    frames = recorded(steps).frames()
    numbers = [frame.step for frame in frames]
    assert numbers[0] == 1
    assert numbers[-1] == steps
    assert numbers == sorted(set(numbers))
    assert len(frames) == min(steps, FRAMES)


def test_frames_are_spread_over_the_movement_not_over_the_time():
    frames = recorded(200, lambda share: np.exp(-8 * share)).frames()
    heights = np.array([frame.positions[0, 2] for frame in frames])
    assert [frame.step for frame in frames][4] < 100  # most of it happens early
    assert np.abs(np.diff(heights)).max() < 3 / FRAMES


def test_frames_are_eight_however_suddenly_the_sheet_falls():
    frames = recorded(30, lambda share: 1.0 if share < 0.5 else 0.0).frames()
    numbers = [frame.step for frame in frames]
    assert len(frames) == FRAMES
    assert numbers == sorted(set(numbers))
    assert {1, 15, 30} < set(numbers)


def test_frames_do_not_fill_the_memory():
    assert len(recorded(1000)._kept) <= KEPT


def test_a_page_that_never_moves_has_frames_all_the_same():
    assert [frame.step for frame in recorded(50, lambda share: 0.0).frames()] == [1, 50]


def test_no_steps_no_frames():
    assert Recorder().frames() == []


def test_frames_sheet_has_a_place_for_each(page):
    recorder = Recorder()
    for step in range(1, 9):
        recorder(step, page.flat.vertices * (1, 1, 1 - step / 8), page.flat.faces)
    sheet = frames_sheet(recorder.frames(), page.flat)
    assert sheet.shape == (HEIGHT * FRAMES // COLUMNS, WIDTH * COLUMNS, 3)
    assert not np.array_equal(sheet[:HEIGHT, :WIDTH], sheet[:HEIGHT, WIDTH : 2 * WIDTH])


def test_what_was_not_seen_is_hatched_and_reported_in_the_review(page, scan):
    coverage = page.coverage.copy()
    coverage[:30, :40] = CoverageClass.OCCLUDED
    coverage[40:, 60:] = CoverageClass.INPAINTED
    image = np.full_like(page.image, 255)
    marked = hatch_unseen(page.with_pictures(image=image, coverage=coverage))
    for kind, part in ((CoverageClass.OCCLUDED, marked[:30, :40]), (CoverageClass.INPAINTED, marked[40:, 60:])):
        assert 0.15 < (part == HATCHES[kind][0]).all(axis=2).mean() < 0.5
    untouched = coverage == CoverageClass.MEASURED
    assert (marked[untouched] == 255).all()


@pytest.mark.parametrize("size_mm", [(400.0, 45.0), (45.0, 400.0), (400.0, 3.0)])
def test_strain_is_drawn_of_a_page_of_any_shape(page, size_mm):
    flat = page.fine.flat / np.ptp(page.fine.flat, axis=0) * size_mm
    picture = strain_picture(replace(page, fine=replace(page.fine, flat=flat)))
    assert picture.shape[0] > 0 < picture.shape[1]

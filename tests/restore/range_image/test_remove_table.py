"""Meshes of pages on a table, as scanners and photographs give them: one surface, with faces from page to table."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from drivers.simulated import Curl, MultiFold, Pose, Wave, shoot
from restore import Settings, restore, separate_sheets
from restore.mesh.clean import large_pieces
from restore.mesh.measures import surface_area
from restore.mesh.validate import ValidMesh
from restore.range_image.remove_table import remove_table

PAGE_MM = (200.0, 150.0)
ROUGH = 0.04  # of the page's area: noise of 0.1 mm on edges of 1 mm makes it larger by 0.02
SIZE_MM = 0.1  # of a vertex's spacing of 1 mm: the picture shows the edge where the mesh has none
BRIDGED = 4.0  # steps: gaps that are wider stay open
TURN = Rotation.random(random_state=1).as_matrix()
SHEETS = {"roll": Curl(), "wave": Wave(), "folded": MultiFold()}


@cache
def mesh_of(sheet, step, seed=0, turned=False, page_mm=PAGE_MM):
    """An irregular mesh of what a scanner sees of a page and its table, a vertex in each step × step samples."""
    scan, truth = shoot(sheet, seed=seed, page_mm=page_mm, pose=Pose(tilt_deg=3.0, turn_deg=4.0))
    random = np.random.default_rng(seed)
    rows, cols = np.mgrid[: scan.measured.shape[0] - step : step, : scan.measured.shape[1] - step : step]
    rows, cols = (part.ravel() + random.integers(0, step, part.size) for part in (rows, cols))
    rows, cols = (part[scan.measured[rows, cols]] for part in (rows, cols))
    places = np.stack([cols, -rows], axis=1) + random.normal(0.0, 0.01, (len(rows), 2))  # no four are on a circle
    faces = Delaunay(places).simplices
    longest = np.linalg.norm(places[faces] - places[np.roll(faces, 1, axis=1)], axis=2).max(axis=1)
    vertices = scan.points[rows, cols] @ (TURN if turned else np.eye(3))
    faces = faces[longest < BRIDGED * step].astype(np.int64)
    return ValidMesh(vertices, faces, scan.texture_xy[rows, cols], scan.texture, {"unit": "mm"}), truth


@pytest.mark.parametrize("kind", SHEETS)
@pytest.mark.parametrize("step", [pytest.param(2, marks=pytest.mark.slow), 5])
@pytest.mark.parametrize("white", [False, True])
def test_the_page_is_left_without_its_table(kind, step, white):
    """Of another colour, or of the paper's."""
    mesh, truth = mesh_of(SHEETS[kind], step, turned=True)
    if white:
        mesh = replace(mesh, texture=np.full_like(mesh.texture, 225))
    page = remove_table(mesh)
    largest = max(large_pieces(page), key=len)
    spacing = np.sqrt(surface_area(mesh.vertices, mesh.faces) / len(mesh.vertices))
    width, height = truth.page_mm
    area = surface_area(page.vertices, page.faces[largest])
    assert (width - 2 * spacing) * (height - 2 * spacing) < area < (1.0 + ROUGH) * width * height


@pytest.mark.slow
def test_what_is_left_of_a_page_has_no_table():
    page = remove_table(mesh_of(Curl(), 3)[0])
    assert remove_table(page) is page


@pytest.mark.parametrize("kind", ["a dark frame", "one colour", "no colour"])
def test_a_page_that_rises_from_a_flat_margin_keeps_it(kind):
    """280 × 200 mm with a vertex every 1.6 mm: a frame is printed on its margin, or nothing, or there is no picture."""
    random = np.random.default_rng(0)
    x, y = (part.ravel() for part in np.meshgrid(np.arange(0.0, 280.0, 1.6), np.arange(0.0, 200.0, 1.6)))
    x, y = (part + random.uniform(-0.5, 0.5, part.size) for part in (x, y))
    from_side = np.minimum.reduce([x, y, 280.0 - x, 200.0 - y])
    z = 12.0 * np.clip((from_side - 27.0) / 60.0, 0.0, 1.0) ** 2 + random.normal(0.0, 0.03, x.size)
    texture = np.full((200, 280, 3), 60, np.uint8)
    texture[25:-25, 25:-25] = 225 if kind == "a dark frame" else 60
    picture = () if kind == "no colour" else (np.stack([x, 200.0 - y], axis=1) - 0.5, texture)
    faces = Delaunay(np.stack([x, y], axis=1)).simplices.astype(np.int64)
    mesh = ValidMesh(np.stack([x, y, z], axis=1), faces, *picture)
    assert remove_table(mesh) is mesh


def test_two_triangles_have_no_table():
    corners = np.array([[0.0, 0.0, 0.0], [200.0, 0.0, 0.0], [200.0, 150.0, 10.0], [0.0, 150.0, 0.0]])
    texture = np.random.default_rng(0).integers(0, 255, (150, 200, 3)).astype(np.uint8)
    mesh = ValidMesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), corners[:, :2], texture)
    assert remove_table(mesh) is mesh


def test_a_mesh_that_no_single_view_shows_is_left_as_it_is():
    angle = np.repeat(np.linspace(0.0, 6.0, 60), 20)  # a tube, slit open
    vertices = np.stack([30.0 * np.cos(angle), np.tile(np.linspace(0.0, 100.0, 20), 60), 30.0 * np.sin(angle)], axis=1)
    index = np.arange(1200).reshape(60, 20)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]))
    mesh = ValidMesh(vertices, np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)]))
    assert remove_table(mesh) is mesh


@pytest.mark.slow
def test_a_page_of_a_mesh_on_a_table_has_its_true_size():
    mesh, truth = mesh_of(Wave(), 2, page_mm=(280.0, 200.0))
    page = restore(mesh, Settings(dpi=60))
    np.testing.assert_allclose(page.report["page_mm"], truth.page_mm, atol=SIZE_MM)
    assert page.report["findings"] == []


def test_two_pages_on_a_table_are_two_sheets():
    """Curls of 90 × 120 mm side by side on a table of 300 × 200 mm, one surface with a vertex every 1.5 mm."""
    random = np.random.default_rng(0)
    x, y = (part.ravel() for part in np.meshgrid(np.arange(0.0, 300.0, 1.5), np.arange(0.0, 200.0, 1.5)))
    x, y = (part + random.uniform(-0.4, 0.4, part.size) for part in (x, y))
    corners = [(40.0, 40.0), (170.0, 45.0)]
    on = [(x > left) & (x < left + 90.0) & (y > low) & (y < low + 120.0) for left, low in corners]
    z = random.normal(0.0, 0.03, x.size)
    for page, (left, _) in zip(on, corners, strict=True):
        z[page] += 6.0 + np.sqrt(90.0**2 - (x[page] - left - 45.0) ** 2) - 78.0
    texture = np.full((200, 300, 3), 50, np.uint8)
    for left, low in corners:
        texture[200 - int(low) - 120 : 200 - int(low), int(left) : int(left) + 90] = 210
    faces = Delaunay(np.stack([x, y], axis=1)).simplices.astype(np.int64)
    mesh = ValidMesh(np.stack([x, y, z], axis=1), faces, np.stack([x, 200.0 - y], axis=1) - 0.5, texture)
    left, right = separate_sheets(mesh)
    for sheet, (low, _) in zip((left, right), corners, strict=True):
        across = sheet.scan.vertices[:, 0]
        assert low < across.min() < low + 2.0
        assert low + 88.0 < across.max() < low + 90.0


def test_nothing_hangs_from_a_page_to_samples_that_are_off_their_table():
    """A page 20 mm above it, in whose shadow, 6 mm wide, is none; each tenth vertex beside it is 0.6 mm too high."""
    random = np.random.default_rng(3)
    x, y = (part.ravel() for part in np.meshgrid(np.arange(0.0, 280.0, 2.0), np.arange(0.0, 230.0, 2.0)))
    x, y = (part + random.uniform(-0.7, 0.7, part.size) for part in (x, y))
    beyond = np.maximum(np.abs(x - 140.0) - 100.0, np.abs(y - 115.0) - 75.0)
    seen = ~((beyond > 0.0) & (x > 240.0) & (x < 246.0))
    x, y, beyond = x[seen], y[seen], beyond[seen]
    z = np.where(beyond < 0.0, 20.0, 0.0) + random.normal(0.0, 0.03, x.size)
    z += 0.6 * ((beyond > 0.0) & (beyond < 10.0) & (random.random(x.size) < 0.1))
    texture = np.full((230, 280, 3), 60, np.uint8)
    texture[40:190, 40:240] = 225
    faces = Delaunay(np.stack([x, y], axis=1)).simplices.astype(np.int64)
    mesh = ValidMesh(
        np.stack([x, y, z], axis=1), faces, np.stack([x, 230.0 - y], axis=1) - 0.5, texture, provenance={"unit": "mm"}
    )
    page = remove_table(mesh)
    largest = page.vertices[page.faces[max(large_pieces(page), key=len)]]
    assert largest[..., 2].min() > 19.0
    np.testing.assert_allclose(np.ptp(largest.reshape(-1, 3), axis=0)[:2], (200.0, 150.0), atol=4.0)

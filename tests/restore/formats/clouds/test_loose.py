"""Loose clouds become range images that end with the points, at any density and noise."""

from pathlib import Path

import numpy as np
import pytest

from restore import Settings, restore
from restore.errors import BadInput
from restore.formats import load_scan
from restore.formats.clouds.cloud import cloud_of
from restore.formats.clouds.loose import loose_scan

PAGE_MM = (150.0, 100.0)
SIZE_MM = 0.5  # of cells of half a millimetre: a third of one on each side
A = Path("a.xyz")
CAMERA = np.array([1.0, -1.0, -1.0])


def sheet(rng, count=60_000, noise=0.0, right=PAGE_MM[0]):
    """Points and colours (n, 3) of a curled page, 700 mm before a scanner; its places (n, 2)."""
    u, v = rng.uniform(0, right, count), rng.uniform(0, PAGE_MM[1], count)
    angle = (u - PAGE_MM[0] / 2) / 120.0
    points = np.column_stack([120.0 * np.sin(angle), PAGE_MM[1] / 2 - v, 120.0 * np.cos(angle) - 820.0])
    points += noise * rng.normal(size=(count, 1)) * points / np.linalg.norm(points, axis=1, keepdims=True)
    colours = np.column_stack([u, v, np.full(count, 200)]).astype(np.uint8)
    return points, colours


def size_of(scan):
    page = restore(scan, Settings(dpi=100, shading="keep"))
    return sorted(page.report["page_mm"], reverse=True), page


@pytest.mark.parametrize(("noise", "within"), [(0.0, SIZE_MM), (0.1, SIZE_MM), (0.3, 2 * SIZE_MM)])
def test_a_page_keeps_its_size_and_its_side(noise, within):
    points, colours = sheet(np.random.default_rng(0), noise=noise)
    size, page = size_of(loose_scan(A, cloud_of(A, points * CAMERA, colours)))
    np.testing.assert_allclose(size, PAGE_MM, atol=within)
    middle = page.image[page.image.shape[0] // 2]
    assert middle[-60, 0] > middle[60, 0] + 50  # red rises to the right
    assert page.image[-60, page.image.shape[1] // 2, 1] > page.image[60, page.image.shape[1] // 2, 1]


def test_passes_that_overlap_and_steps_in_density():
    rng = np.random.default_rng(1)
    parts = [sheet(rng, 60_000, 0.1), sheet(rng, 20_000, 0.1, right=60.0)]
    points, colours = (np.concatenate(some) for some in zip(*parts, strict=True))
    size, _ = size_of(loose_scan(A, cloud_of(A, points + [0, 0, 0.0], colours)))
    np.testing.assert_allclose(size, PAGE_MM, atol=SIZE_MM)


def test_points_off_the_surface_are_not_a_part_of_it():
    rng = np.random.default_rng(2)
    points, colours = sheet(rng, noise=0.05)
    some = rng.choice(len(points), len(points) // 50, replace=False)
    points[some] *= 1.0 + rng.uniform(-0.03, 0.03, (len(some), 1))
    size, _ = size_of(loose_scan(A, cloud_of(A, points, colours)))
    np.testing.assert_allclose(size, PAGE_MM, atol=2 * SIZE_MM)


def test_normals_show_the_printed_side():
    points, colours = sheet(np.random.default_rng(3))
    away = points + [0.0, 0.0, 900.0]  # behind the origin: it would be seen from below
    towards = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    seen = loose_scan(A, cloud_of(A, away, colours, normals=towards))
    middle = seen.texture[seen.texture.shape[0] // 2]
    assert middle[-60, 0] > middle[60, 0] + 50


def test_a_tube_has_no_view(tmp_path):
    rng = np.random.default_rng(4)
    angle, along = rng.uniform(0, 2 * np.pi, 20_000), rng.uniform(0, 200, 20_000)
    np.savetxt(tmp_path / "a.xyz", np.column_stack([30 * np.cos(angle), along, 30 * np.sin(angle) - 500]), "%.4f")
    with pytest.raises(BadInput, match="no single view"):
        load_scan(tmp_path / "a.xyz")


def test_a_picture_has_no_place_on_it(tmp_path, sheet_file):
    with pytest.raises(BadInput, match="not known"):
        load_scan(sheet_file, tmp_path / "b.png")


@pytest.fixture
def sheet_file(tmp_path):
    from PIL import Image

    points, _ = sheet(np.random.default_rng(5), 5000)
    np.savetxt(tmp_path / "a.xyz", points, "%.4f")
    Image.new("RGB", (30, 20)).save(tmp_path / "b.png")
    return tmp_path / "a.xyz"

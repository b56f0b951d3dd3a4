"""Texture coordinates that run the wrong way: turned over in an atlas, noted in a single chart."""

import numpy as np
import pytest

from restore import Settings, restore
from restore.formats.cleaning.texture_map import colours_at, with_oriented_map
from restore.scan import SurfaceMesh

COLS, ROWS, STEP_MM, PX_PER_MM, MARGIN = 31, 21, 5.0, 3.0, 8


def picture(rng):
    """Blots in all colours (h, w, 3), which differ wherever they are compared."""
    coarse = rng.integers(0, 255, (12, 18, 3)).astype(np.uint8)
    return coarse.repeat(28, axis=0).repeat(28, axis=1)[: int((ROWS - 1) * 15), : int((COLS - 1) * 15)]


def chart(rng, bow):
    """A curled page and its picture, its texture coordinates along arc length as an unwrapper writes them."""
    across, up = np.meshgrid(np.arange(COLS) * STEP_MM, np.arange(ROWS) * STEP_MM)
    angle = bow * 0.9 * np.exp(-across / 35.0)
    x = np.cumsum(np.cos(angle) * STEP_MM, axis=1)
    z = np.cumsum(np.sin(angle) * STEP_MM, axis=1)
    vertices = np.stack([x, up, z], axis=-1).reshape(-1, 3)
    number = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    faces = np.concatenate([np.stack(corners, axis=-1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))])
    flat = np.stack([across, (ROWS - 1) * STEP_MM - up], axis=-1).reshape(-1, 2) * PX_PER_MM
    return SurfaceMesh(vertices, faces, flat - 0.5, picture(rng))


def atlas(whole):
    """The page in three charts, one below the other in the picture, in another order and with a margin."""
    column = (whole.faces % COLS).min(axis=1) // 10
    places, faces, height = [], [], whole.texture.shape[0] + MARGIN
    sheet = np.full((3 * height, whole.texture.shape[1], 3), 128, np.uint8)
    used = []
    for number, slot in ((0, 2), (1, 0), (2, 1)):
        corners = np.unique(whole.faces[column == number])
        there = np.zeros(len(whole.vertices), np.int64)
        there[corners] = sum(map(len, used)) + np.arange(len(corners))
        faces.append(there[whole.faces[column == number]])
        used.append(corners)
        places.append(whole.texcoords[corners] + [0.0, slot * height])
        left, right = int(number * 10 * 15), int(min((number + 1) * 10 * 15, whole.texture.shape[1]))
        piece = whole.texture[:, left:right]
        sheet[slot * height : slot * height + len(piece), left:right] = piece
    vertices = whole.vertices[np.concatenate(used)]
    return SurfaceMesh(vertices, np.concatenate(faces), np.concatenate(places), sheet)


def turned(mesh, axis):
    texcoords = mesh.texcoords.copy()
    texcoords[:, axis] = mesh.texture.shape[1 - axis] - 1 - texcoords[:, axis]
    return SurfaceMesh(mesh.vertices, mesh.faces, texcoords, mesh.texture)


@pytest.mark.parametrize("axis", [0, 1])
def test_an_atlas_whose_charts_meet_only_turned_over_is_turned_over(rng, axis):
    right = atlas(chart(rng, 1.0))
    assert with_oriented_map(right) is right
    found = with_oriented_map(turned(right, axis))
    np.testing.assert_allclose(found.texcoords, right.texcoords)
    assert found.findings[0].code == "map_turned_over"
    assert "mirrored" not in found.provenance


def test_an_atlas_of_letters_on_white_paper_is_turned_over(rng):
    """Most of a seam is bare paper: the strokes that cross it tell."""
    whole = chart(rng, 1.0)
    page = np.full_like(whole.texture, 244)
    for _ in range(120):
        row, col = rng.integers(0, page.shape[0] - 3), rng.integers(0, page.shape[1] - 30)
        page[row : row + 3, col : col + rng.integers(4, 30)] = 30
    right = atlas(SurfaceMesh(whole.vertices, whole.faces, whole.texcoords, page))
    assert with_oriented_map(right) is right
    np.testing.assert_allclose(with_oriented_map(turned(right, 1)).texcoords, right.texcoords)


def test_seams_on_bare_paper_that_meet_are_left_alone(rng):
    """Turned over, half of their pairs would be of print, and meet as well."""
    whole = chart(rng, 1.0)
    page = np.full_like(whole.texture, 244)
    page[: page.shape[0] // 2, :] = 60
    right = atlas(SurfaceMesh(whole.vertices, whole.faces, whole.texcoords, page))
    assert with_oriented_map(right) is right
    blank = right.texture.copy()
    blank[(blank == 60).all(axis=2)] = 244
    assert with_oriented_map(SurfaceMesh(right.vertices, right.faces, right.texcoords, blank)).findings == ()


def test_a_chart_that_reaches_past_the_picture_has_the_colours_of_its_border(rng):
    """Black in their place met the ruling of another chart, and a right map was turned over."""
    page = picture(rng)
    row, last = 40, page.shape[1] - 1
    places = np.array([[last + 1.2, row], [-0.5, row], [last, row], [0.0, row]])
    beyond, before, at_end, at_start = colours_at(page, places)
    assert beyond.tolist() == at_end.tolist() == page[row, last].tolist()
    assert before.tolist() == at_start.tolist() == page[row, 0].tolist()


def test_a_picture_of_one_colour_is_not_turned_over(rng):
    right = atlas(chart(rng, 1.0))
    blank = SurfaceMesh(right.vertices, right.faces, right.texcoords, np.full_like(right.texture, 90))
    assert with_oriented_map(blank) is blank


@pytest.mark.parametrize("bow", [-1.0, -0.3, 0.3, 1.0])
def test_one_chart_is_said_to_be_mirrored_by_its_map_and_not_by_its_bow(rng, bow):
    right = chart(rng, bow)
    wrong = turned(right, 1)
    assert with_oriented_map(wrong).provenance["mirrored"]
    settings = Settings(dpi=50)
    assert "mirrored" not in [one.code for one in restore(right, settings).findings]
    assert "mirrored" in [one.code for one in restore(wrong, settings).findings]


@pytest.mark.parametrize("bow", [-1.0, 1.0])
def test_no_camera_is_imagined_behind_a_chart_that_hides_the_page(rng, bow):
    assert restore(chart(rng, bow), Settings(dpi=50)).report["coverage"]["occluded"] == 0.0

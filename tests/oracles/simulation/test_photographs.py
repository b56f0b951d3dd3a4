"""Sets of photographs are what their cameras and the exact page say, and repeat from their seed."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import ExifTags, Image

from drivers.simulated import Markers, Wave
from oracles.simulation.photographs import FILM_DIAGONAL_MM, FILM_MM, Shots, encode_jpeg, photograph_page, views_from
from restore.photogrammetry import SCALE_CARD, detect_markers

PAGE_MM = (120.0, 90.0)
SMALL = Shots(size=(640, 480))
CARD_DPI = 177.8  # seven pixels to a millimetre
EXACT_MM = 1e-3  # the page's strips are chords of 0.25 mm, and the hit's face is single precision


@pytest.fixture(scope="module")
def taken():
    card = SCALE_CARD.picture(CARD_DPI)
    shots = Shots(size=(640, 480), focal_jitter=0.002, centre_jitter=0.002)
    return photograph_page(
        Wave(), Markers(), views=3, seed=4, card=card, card_dpi=CARD_DPI, shots=shots, page_mm=PAGE_MM
    )


def test_a_pixel_shows_the_place_of_the_page_that_projects_to_it(taken):
    places = np.array([[20.0, 30.0], [60.0, 45.0], [100.0, 70.0]])
    for number, camera in enumerate(taken.cameras):
        pixels = camera.project(taken.scene.surface(places))
        flat, points = taken.truth_at(number, pixels)
        np.testing.assert_allclose(flat, places, atol=EXACT_MM)
        np.testing.assert_allclose(points, taken.scene.surface(places), atol=EXACT_MM)


def test_the_table_is_not_a_place_of_the_page(taken):
    flat, points = taken.truth_at(0, np.array([[2.0, 2.0]]))
    assert np.isnan(flat).all()
    assert np.isnan(points).all()


def test_the_card_lies_on_the_table_in_its_size(taken):
    found = detect_markers(taken.images[0])
    assert len(found) == 12
    camera = taken.cameras[0]
    rays = camera.through(np.array([found[number] for number in sorted(found)]))
    table = taken.scene.vertices[taken.scene.faces[~taken.scene.on_page][0], 2].mean()
    on_table = (camera.position + rays * ((table - camera.position[2]) / rays[:, 2])[:, None])[:, :2]
    distances = np.linalg.norm(on_table[:, None] - on_table, axis=-1)
    known = np.linalg.norm(SCALE_CARD.centres[:, None] - SCALE_CARD.centres, axis=-1)
    np.testing.assert_allclose(distances, known, atol=0.3)  # a third of a pixel


def test_shots_differ_in_light_and_lens(taken):
    focals = [camera.focal_px for camera in taken.cameras]
    assert len(set(focals)) == 3
    assert max(focals) / min(focals) < 1.02
    means = np.array([image.reshape(-1, 3).mean(axis=0) for image in taken.images])
    assert (np.ptp(means, axis=0) > 1.0).all()


def test_a_set_repeats_from_its_seed():
    sets = [
        photograph_page(Wave(), Markers(), views=1, seed=seed, shots=Shots(size=(96, 72)), page_mm=PAGE_MM)
        for seed in (1, 1, 2)
    ]
    assert (sets[0].images[0] == sets[1].images[0]).all()
    assert (sets[0].images[0] != sets[2].images[0]).any()


def test_the_focal_length_is_read_from_files(taken, tmp_path):
    paths = taken.save(tmp_path)
    assert [path.name for path in paths] == ["IMG_0001.jpg", "IMG_0002.jpg", "IMG_0003.jpg"]
    with Image.open(paths[0]) as picture:
        exif = picture.getexif().get_ifd(ExifTags.IFD.Exif)
        assert picture.size == (640, 480)
    assert exif[ExifTags.Base.FocalLengthIn35mmFilm] == FILM_MM
    assert SMALL.focal_px == pytest.approx(FILM_MM / FILM_DIAGONAL_MM * 800)
    with Image.open(io.BytesIO(encode_jpeg(taken.images[0], film_mm=None))) as plain:
        assert not plain.getexif().get_ifd(ExifTags.IFD.Exif)


def test_views_are_chosen_by_number(taken):
    chosen = views_from(taken, [2, 0])
    assert chosen.cameras == (taken.cameras[2], taken.cameras[0])
    assert (chosen.images[1] == taken.images[0]).all()

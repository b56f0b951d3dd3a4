"""Views that do not show the page of the others are named; so is a card that was moved."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from oracles.table_cameras import FOCAL_PX, cameras
from restore import Photograph
from restore.camera.photo_camera import PhotoCamera
from restore.findings import Finding
from restore.photogrammetry import SCALE_CARD
from restore.photogrammetry.cameras.agreement import (
    card_findings,
    check_found,
    check_optics,
    check_residuals,
    find_markers,
    with_blur,
    within,
    without,
)
from restore.photogrammetry.cameras.bundle import Tracks, adjust
from restore.photogrammetry.errors import CardApart, Mirrored, NoPage, TooFewViews, ViewsApart

VIEWS = (2, 3, 5, 7, 8)
PATCHES = 400
SCALE = {"from": "card", "residual_mm": 0.03}
CARD = np.column_stack([SCALE_CARD.centres + [0.0, -90.0], np.zeros(len(SCALE_CARD.centres))])
GRID = np.stack(np.meshgrid(np.linspace(-90, 90, 12), np.linspace(-60, 60, 9)), axis=-1).reshape(-1, 2)
WAVE = np.column_stack([GRID, 12.0 * np.sin(GRID[:, 0] / 25.0)])
BLANK = np.full((40, 60, 3), 200, np.uint8)


def found(fraction_of_one: float) -> np.ndarray:
    rng = np.random.default_rng(1)
    return rng.random((len(VIEWS), PATCHES)) < np.array([0.9, 0.95, fraction_of_one, 0.8, 1.0])[:, None]


def test_a_view_of_another_page_is_named():
    everywhere = np.ones((len(VIEWS), PATCHES), bool)
    with pytest.raises(ViewsApart) as apart:
        check_found(found(0.1), everywhere, VIEWS)
    assert apart.value.reasons == {5: Finding.of("other_page")}
    check_found(found(0.6), everywhere, VIEWS)  # a hand over a part of the page


def test_a_view_of_a_part_of_the_page_is_checked_by_that_part():
    share = found(1.0)
    in_frame = np.ones_like(share)
    in_frame[2, PATCHES // 10 :] = False
    check_found(share & in_frame, in_frame, VIEWS)


def test_a_view_of_the_page_bent_otherwise_is_named():
    rng = np.random.default_rng(2)
    view = np.repeat(np.arange(len(VIEWS)), PATCHES)
    sigma = rng.uniform(0.02, 0.1, len(view))
    residuals = rng.normal(0, 1, (len(view), 2)) * sigma[:, None]
    check_residuals(residuals, sigma, view, VIEWS)
    residuals[view == 3] *= 8
    with pytest.raises(ViewsApart) as apart:
        check_residuals(residuals, sigma, view, VIEWS)
    assert apart.value.reasons == {7: Finding.of("other_shape")}


def test_a_zoomed_view_is_named():
    views = cameras(5)
    views[2] = zoomed(views[2], 1.15)
    tracks = tracks_of(views)
    one_lens = [zoomed(camera, FOCAL_PX / camera.focal_px) for camera in views]
    with pytest.raises(ViewsApart) as apart:
        check_optics(adjust(one_lens, WAVE, tracks), tracks, VIEWS)
    assert list(apart.value.reasons) == [5]
    assert "+15%" in apart.value.reasons[5].text


@pytest.mark.parametrize("rows", [(2,), (0, 1, 3, 4)])
def test_cropped_views_are_named(rows):
    views = cameras(5)
    for row in rows:
        views[row] = cropped(views[row], 40.0 - 20.0 * row, 25.0)
    tracks = tracks_of(views)
    with pytest.raises(ViewsApart) as apart:
        check_optics(adjust(cameras(5), WAVE, tracks), tracks, VIEWS)
    assert all(why.code == "cropped" for why in apart.value.reasons.values())
    assert len(VIEWS) - len(apart.value.reasons) < 3 if len(rows) > 1 else list(apart.value.reasons) == [5]


def test_views_through_one_lens_are_called_neither_zoomed_nor_cropped():
    tracks = tracks_of(cameras(5))
    check_optics(adjust(cameras(5), WAVE, tracks), tracks, VIEWS)


def zoomed(camera, factor):
    vector = camera.vector.copy()
    vector[6] *= factor
    return PhotoCamera(vector, camera.size)


def cropped(camera, left, top):
    """A camera whose pictures were cut on the left and at the top, pixels, and as much on the other side less."""
    vector = camera.vector.copy()
    vector[7:9] += left, top
    return PhotoCamera(vector, camera.size)


def tracks_of(views):
    rng = np.random.default_rng(4)
    pixels = np.concatenate([camera.project(WAVE) for camera in views]) + rng.normal(
        0, 0.05, (len(views) * len(WAVE), 2)
    )
    view, point = np.divmod(np.arange(len(pixels)), len(WAVE))
    return Tracks(view, point, pixels, np.ones(len(pixels)))


def test_points_next_to_a_picture_are_not_within_it():
    camera = cameras(1)[0]
    assert within([camera], np.array([[0.0, 0.0, 0.0], [5000.0, 0.0, 0.0]])).tolist() == [[True, False]]


def test_three_views_must_be_left():
    names = [f"{number}.jpg" for number in range(9)]
    apart = ViewsApart({5: Finding.of("other_page")})
    failed = {1: Finding.of("not_joined", reason="blurred")}
    assert without(failed, apart, 4, names) == {**failed, 5: Finding.of("other_page")}
    with pytest.raises(TooFewViews, match=r"2 photographs show one page .* 1\.jpg: blurred; 5\.jpg: it shows") as fault:
        without(failed, apart, 3, names)
    assert fault.value.exit_code == 5


def placed(count):
    return [Photograph(BLANK, f"{number}.jpg", camera=camera) for number, camera in enumerate(cameras(count))]


def seen_by(photographs, moved=()):
    push = {number: np.array([4.0 * np.cos(2 * number), 4.0 * np.sin(2 * number), 0]) for number in moved}
    return {
        number: dict(enumerate(one.camera.project(CARD + push.get(number, 0.0))))
        for number, one in enumerate(photographs)
    }


def test_a_card_that_lies_still_gives_no_doubt():
    photographs = placed(5)
    assert card_findings(photographs, seen_by(photographs), SCALE) == ()


def test_photographs_after_the_card_was_moved_are_named():
    photographs = placed(5)
    (found,) = card_findings(photographs, seen_by(photographs, (1, 4)), SCALE)
    assert "in 1.jpg, 4.jpg the card has another position" in found.text


def test_a_card_that_never_lies_where_it_lay_is_refused():
    photographs = placed(4)
    seen = seen_by(photographs, range(4))
    with pytest.raises(CardApart, match="no three photographs agree") as fault:
        card_findings(photographs, seen, {"from": "none"})
    assert "as the camera wrote them" in fault.value.hint


def test_a_card_in_two_photographs_is_said():
    photographs = placed(5)
    seen = {number: markers for number, markers in seen_by(photographs).items() if number < 2}
    (found,) = card_findings(photographs, seen, {"from": "none"})
    assert found.text.startswith("fewer than three photographs show the scale card")


def test_a_card_that_is_not_flat_is_said():
    photographs = placed(5)
    (found,) = card_findings(photographs, seen_by(photographs), {**SCALE, "residual_mm": 0.8})
    assert "deviate by 0.80 mm" in found.text


def test_a_card_that_cannot_be_is_refused():
    photographs = placed(5)
    with pytest.raises(CardApart, match=r"1\.7 mm off") as fault:
        card_findings(photographs, seen_by(photographs), {**SCALE, "residual_mm": 1.7})
    assert fault.value.exit_code == 5


def test_where_no_page_is_found_blurred_photographs_are_named():
    rng = np.random.default_rng(6)
    blocks = cv2.resize(
        rng.integers(60, 200, (15, 20, 3), np.uint8), None, fx=30, fy=30, interpolation=cv2.INTER_NEAREST
    )
    sharp = Photograph(blocks, "sharp.jpg")
    blurred = Photograph(cv2.GaussianBlur(blocks, (0, 0), 4.0), "blurred.jpg")
    fault = NoPage("only 7 points lie on a page", "lay it on a table")
    named = with_blur(fault, [sharp, blurred])
    assert str(named) == "only 7 points lie on a page; blurred: blurred.jpg"
    assert "still" in named.hint
    assert with_blur(fault, [sharp]) is fault


def test_a_mirrored_photograph_is_named():
    card = np.pad(SCALE_CARD.picture(100.0), 40, constant_values=90)
    good = Photograph(np.repeat(card[..., None], 3, axis=2), "good.jpg")
    mirrored = replace(good, image=np.ascontiguousarray(good.image[:, ::-1]), name="mirrored.jpg")
    assert len(find_markers([good], SCALE_CARD)[0]) == 12
    with pytest.raises(Mirrored, match=r"mirrored: mirrored\.jpg") as fault:
        find_markers([good, mirrored, Photograph(BLANK, "blank.jpg")], SCALE_CARD)
    assert fault.value.exit_code == 3

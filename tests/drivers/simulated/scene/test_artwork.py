"""What is printed, and whether the truth about it is true."""

import cv2
import numpy as np
import pytest

from drivers.simulated.scene.artwork import ARTWORK, Artwork, Box, Figure, Markers, Print, Text, White
from drivers.simulated.scene.artwork.figure import INKS
from drivers.simulated.scene.artwork.printed import BLACK, MM_PER_PIXEL, PAPER
from drivers.simulated.scene.artwork.text import SENTENCES, TITLE

PAGE = (280.0, 200.0)
CORNER_MM = 0.05  # the detector's sub-pixel refinement on a 300 dpi print: half a pixel
INK_MARGIN_PX = 2  # anti-aliased letters reach this far beyond their box


def pixels(box: Box) -> tuple[slice, slice]:
    left, bottom, right, top = (v / MM_PER_PIXEL for v in box)
    height = PAGE[1] / MM_PER_PIXEL
    return slice(round(height - top), round(height - bottom)), slice(round(left), round(right))


def found_markers(image: np.ndarray) -> dict[int, np.ndarray]:
    """id → (4, 2) corners in pixels, the centre of the upper left pixel at 0."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250), parameters)
    corners, ids, _ = detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY))
    return {int(i): c[0] for i, c in zip(ids.ravel(), corners, strict=True)}


def test_markers_are_where_they_are_said_to_be() -> None:
    printed = Markers().print_on(PAGE)
    found = found_markers(printed.image)
    assert found.keys() == printed.markers.keys() == set(range(12 * 9))
    for i, corners in found.items():
        on_page = np.array([0, PAGE[1]]) + (corners + 0.5) * MM_PER_PIXEL * [1, -1]
        np.testing.assert_allclose(on_page, printed.markers[i], atol=CORNER_MM)


def test_the_marker_page_has_the_usual_layout() -> None:
    markers = Markers().print_on(PAGE).markers
    np.testing.assert_allclose(
        markers[0], [[7.9587, 192.0413], [23.9607, 192.0413], [23.9607, 176.0393], [7.9587, 176.0393]], atol=1e-4
    )
    np.testing.assert_allclose(markers[13][0] - markers[0][0], [21.5053, -21.5053], atol=1e-4)


@pytest.mark.parametrize(("page", "count"), [((105.0, 148.0), 4 * 6), ((297.0, 420.0), 13 * 19), ((20.0, 20.0), 0)])
def test_markers_fill_a_page_of_any_size(page: tuple[float, float], count: int) -> None:
    assert len(Markers().print_on(page).markers) == count


@pytest.mark.parametrize("artwork", [Text(), Text(columns=2, face="sans", seed=3), Figure()])
def test_words_are_where_they_are_said_to_be(artwork: Artwork) -> None:
    printed = artwork.print_on(PAGE)
    ink = (np.abs(printed.image.astype(int) - PAPER).max(axis=2) > 40).astype(np.uint8)
    claimed = np.zeros_like(ink)
    for word in printed.words:
        rows, cols = pixels(word.box)
        assert ink[rows, cols].any()
        claimed[rows, cols] += 1
    assert claimed.max() == 1  # no word lies on another
    if isinstance(artwork, Text):
        unclaimed = cv2.dilate(claimed, np.ones((2 * INK_MARGIN_PX + 1,) * 2, np.uint8)) == 0
        assert not ink[unclaimed].any()  # and no ink is left without its word


def test_text_is_set_in_all_its_sizes_from_real_sentences() -> None:
    words = Text(title_pt=30, sizes_pt=(18, 12, 9)).print_on(PAGE).words
    assert {word.size_pt for word in words} == {30, 18, 12, 9}
    assert " ".join(word.text for word in words[:5]) == TITLE
    assert {word.text for word in words[5:]} <= {w for sentence in SENTENCES for w in sentence.split()}
    tall = {size: np.median([w.box[3] - w.box[1] for w in words if w.size_pt == size]) for size in (18, 9)}
    assert tall[18] / tall[9] == pytest.approx(2, rel=0.15)  # a box is as tall as its tallest letter


def test_text_stays_inside_its_margins() -> None:
    for columns in (1, 2):
        boxes = np.array([word.box for word in Text(columns=columns, margin_mm=20).print_on(PAGE).words])
        assert boxes[:, 0].min() > 19
        assert boxes[:, 2].max() < PAGE[0] - 19
        assert boxes[:, 1].min() > 19
        assert boxes[:, 3].max() < PAGE[1] - 19


def test_ink_fields_hold_nothing_but_their_ink() -> None:
    printed = Figure().print_on(PAGE)
    assert printed.patches.keys() == INKS.keys()
    for ink, box in printed.patches.items():
        assert (printed.image[pixels(box)] == INKS[ink]).all()


@pytest.mark.parametrize("kind", ARTWORK.values())
def test_a_print_repeats_and_covers_the_page(kind: type[Artwork]) -> None:
    first, second = (kind().print_on(PAGE) for _ in range(2))
    np.testing.assert_array_equal(first.image, second.image)
    size = np.array(first.image.shape[1::-1]) * MM_PER_PIXEL
    assert (size >= PAGE).all()
    assert (size < np.array(PAGE) + MM_PER_PIXEL).all()


def test_white_is_white_and_black_is_dark_in_the_laser() -> None:
    printed: Print = White().print_on((50.0, 40.0))
    assert (printed.image == PAPER).all()
    assert BLACK[0] < 64  # sRGB 64 is 5 % of the light

"""A simulated volume shows the opening to which its leaves are turned, and nothing else does."""

from __future__ import annotations

from typing import Any

import pytest

from drivers import SettingsError, Turner, open_scanner
from drivers.simulated import rig
from drivers.simulated.book import DEFOCUSED_PX, LeavesSensor, presented
from drivers.simulated.config import OpeningConfig
from drivers.simulated.imaging.colour import BLUR_PX
from drivers.vivid900.geometry.lenses import FAST
from drivers.vivid900.settings import VividSettings

TEXT, MAP = OpeningConfig(artwork="text"), OpeningConfig(artwork="engraving")
NOT_TURNED = OpeningConfig(artwork="figure", first_shot="not turned")
DEFOCUSED = OpeningConfig(artwork="figure", first_shot="out of focus")
PPI = 53.5  # of the colour image at 900 mm
BOOK = (TEXT, NOT_TURNED, DEFOCUSED, MAP)


@pytest.mark.parametrize(
    ("opening", "attempt", "scene", "blur_px"),
    [
        (0, 0, TEXT, BLUR_PX),
        (1, 0, TEXT, BLUR_PX),
        (1, 1, NOT_TURNED, BLUR_PX),
        (2, 0, DEFOCUSED, DEFOCUSED_PX),
        (2, 1, DEFOCUSED, BLUR_PX),
        (3, 2, MAP, BLUR_PX),
        (9, 0, MAP, BLUR_PX),
    ],
)
def test_the_first_shot_goes_wrong_where_it_is_to(opening, attempt, scene, blur_px):
    shown = presented(BOOK, opening, attempt)
    assert (shown.scene, shown.blur_px) == (scene, blur_px)


def test_each_shot_has_noise_of_its_own():
    seeds = [presented(BOOK, opening, attempt).seed for opening in range(len(BOOK)) for attempt in range(3)]
    assert len(set(seeds)) == len(seeds)


def test_a_leaf_that_is_not_turned_at_the_beginning_shows_the_beginning():
    assert presented((NOT_TURNED, MAP), 0, 0).scene == NOT_TURNED


def test_turning_to_where_it_lies_changes_nothing():
    looked: list[Any] = []
    leaves = LeavesSensor(BOOK, lambda shown: looked.append(shown) or rig(table("white")).sensor)
    for place in ((0, 0), (0, 0), (3, 0), (3, 0), (3, 1)):
        leaves.turn_to(*place)
    assert [shown.scene for shown in looked] == [TEXT, MAP, MAP]


def table(*artworks: str) -> dict[str, Any]:
    """The table `[scanner]` of a volume of small flat leaves; of one scene for one artwork."""
    scenes = [{"sheet": "flat", "artwork": artwork, "page_mm": [60, 40 + 20 * n]} for n, artwork in enumerate(artworks)]
    return {"driver": "simulated", **({"book": scenes} if len(scenes) > 1 else {"scene": scenes[0]})}


def test_only_a_scanner_before_a_book_turns_leaves():
    with open_scanner(table("white")) as single, open_scanner(table("text", "white")) as book:
        assert isinstance(book, Turner)
        assert not isinstance(single, Turner)


def test_the_scanner_shows_the_leaf_to_which_it_was_turned():
    fast, heights = VividSettings(mode="fast", distance_mm=900), []
    with open_scanner(table("text", "white")) as book:
        for opening in (1, 0):
            book.turn_to(opening, 0)
            picture = book.capture(fast).texture
            heights.append((picture.min(axis=2) > 150).any(axis=1).sum() * 25.4 / PPI)
    assert heights == pytest.approx([60.0, 40.0], rel=0.02)  # of the scale; the leaves differ by half


def test_the_truth_is_that_of_the_leaf():
    sensor = rig(table("text", "white")).sensor
    assert sensor.truth(FAST).page_mm == (60.0, 40.0)
    sensor.turn_to(1, 0)
    assert (sensor.truth(FAST).page_mm, sensor.truth(FAST).words) == ((60.0, 60.0), ())


def test_a_mistake_in_an_opening_is_named():
    with pytest.raises(SettingsError, match="first_shot") as caught:
        open_scanner({"driver": "simulated", "book": [{"sheet": "flat"}, {"first_shot": "torn"}]})
    assert "first_shot" in caught.value.hint

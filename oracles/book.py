"""The truth of the volume of `configs/simulated-book.toml`: how each opening is to be judged, and its leaf sides."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from drivers.simulated import Truth
from drivers.simulated.config import OpeningConfig
from drivers.simulated.scene.artwork import Facing, Word


class Checked(NamedTuple):
    """What the quality check says of an opening.

    number  of the opening, from 1.
    lies    what lies there.
    first   after the first capture. again: after the second; empty where the first is kept.
    sides   the leaf sides that are delivered: `left`, `right` or `page`.
    """

    number: int
    lies: str
    first: str
    again: str
    sides: tuple[str, ...]


BOTH, WHOLE = ("left", "right"), ("page",)
BOOK = (
    Checked(1, "front cover, brown leather", "green, cover", "", WHOLE),
    Checked(2, "board and flyleaf", "green, split", "", BOTH),
    Checked(3, "blank verso and title", "green, split", "", BOTH),
    Checked(4, "text", "green, split", "", BOTH),
    Checked(5, "text with the gutter 9 mm off centre", "green, split", "", BOTH),
    Checked(6, "the leaf was not turned", "red same page as 5", "green, split", BOTH),
    Checked(7, "double-page plate", "green, whole, 4v–5r", "", WHOLE),
    Checked(8, "out of focus, 3 px", "red focus", "green, split", BOTH),
    Checked(9, "blank verso and text", "green, split", "", BOTH),
    Checked(10, "single leaf, 12 mm strip of its neighbour", "green, right kept", "", ("right",)),
    Checked(11, "lies aside, 5–9 % of the outline cut", "amber cut off", "", BOTH),
    Checked(12, "two blank pages", 'green, split, no "same page"', "", BOTH),
    Checked(13, "folded map", "green, whole, not split", "", WHOLE),
    Checked(14, "flat-lying opening, walls of 8°", "amber layout, `2` splits it", "", BOTH),
    Checked(15, "back cover", "green, cover", "", WHOLE),
)
TOTALS = (
    "15 openings, 17 shots: at first 11 green, 2 amber, 2 red; after the two `r` 13 green, 2 amber; "
    "25 leaf sides delivered"
)


def spine_mm(opening: OpeningConfig) -> float | None:
    """Distance of the spine from the left edge of an opening; None where two pages do not lie side by side."""
    _, artwork = opening.build()
    if isinstance(artwork, Facing):
        return artwork.left_mm
    return opening.page_mm[0] / 2 if opening.kind == "plate" else None


def side_sizes(opening: OpeningConfig, sides: tuple[str, ...]) -> Mapping[str, tuple[float, float]]:
    """Leaf side → its width and height, mm."""
    (width, height), spine = opening.page_mm, spine_mm(opening) or 0.0
    widths = {"page": width, "left": spine, "right": width - spine}
    return {side: (widths[side], height) for side in sides}


def words_on(truth: Truth, spine: float, side: str) -> list[Word]:
    """The words that are printed on a leaf side of an opening with its spine at mm from the left edge."""
    if side == "page":
        return list(truth.words)
    return [word for word in truth.words if (word.box[0] < spine) == (side == "left")]

"""Finding on the layout of a scan.

Where the spine is, whether it is one, and what to do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, cast

from restore.report import LayoutReport
from restore.scan import Floats

Advice = Literal["split", "whole", "left", "right", "ask"]
IsSpine = Literal["sure", "unsure", "no"]


@dataclass(frozen=True)
class BookPrior:
    """What is known of a volume before a scan. leaf_mm: (width, height) of a leaf.

    >>> BookPrior(leaf_mm=(120.0, 170.0)).leaf_mm
    (120.0, 170.0)
    """

    leaf_mm: tuple[float, float]


@dataclass(frozen=True, eq=False)
class LayoutFinding:
    """Where the spine of a scan is, and whether it is one.

    advice            split: two leaves · left, right: keep that leaf, drop the strip of the other · whole: one page ·
                      ask: the whole, and an operator decides.
    is_spine          sure, unsure or no.
    spine             (n, 2) from head to tail: pixels of the colour image, the centre of its upper left pixel at
                      (0, 0); mm on the flat page, from its upper left corner, y down, for a scan without one; None
                      without a valley.
    frame             `picture` or `page`: in which of the two it is given.
    sigma_mm          standard deviation of its place on the paper.
    turn_deg          turn of the surface across it; negative for a valley.
    beyond_deg        turn of the surface next to it; positive where pages arch back, as those of a book do.
    bands             fraction of the height in which it was found.
    crossing          fraction of its height at which print runs over it; None without a colour image.
    widths_mm         of what is left and right of it.
    gutter_hidden_mm  least width of paper at it that gave no range.
    reasons           sentences, the decisive one first.

    >>> LayoutFinding("whole", "no", None, reasons=("the surface has no valley",)).as_json()["spine"] is None
    True
    """

    advice: Advice
    is_spine: IsSpine
    spine: Floats | None
    frame: Literal["picture", "page"] = "picture"
    sigma_mm: float | None = None
    turn_deg: float = 0.0
    beyond_deg: float = 0.0
    bands: float = 0.0
    crossing: float | None = None
    widths_mm: tuple[float, float] | None = None
    gutter_hidden_mm: float = 0.0
    reasons: tuple[str, ...] = ()

    def as_json(self) -> LayoutReport:
        """The finding as plain JSON values."""
        spine = None if self.spine is None else [[round(x, 2), round(y, 2)] for x, y in self.spine.tolist()]
        widths = None if self.widths_mm is None else [round(width, 2) for width in self.widths_mm]
        numbers = ("sigma_mm", "turn_deg", "beyond_deg", "bands", "crossing", "gutter_hidden_mm")
        measured = {name: None if (value := getattr(self, name)) is None else round(value, 4) for name in numbers}
        found = {"advice": self.advice, "is_spine": self.is_spine, "spine": spine, "frame": self.frame}
        return cast(LayoutReport, {**found, **measured, "widths_mm": widths, "reasons": list(self.reasons)})

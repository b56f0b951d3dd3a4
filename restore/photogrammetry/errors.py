"""Why a set of photographs cannot be used."""

from __future__ import annotations

from collections.abc import Mapping

from restore.errors import BadInput, LibraryMissing, NotEnoughSurface
from restore.findings import Finding


class MixedLenses(BadInput):
    """Photographs differ in size or focal length.

    They are assumed to be of one lens.
    """


class TooFewViews(NotEnoughSurface):
    """Fewer than three photographs join to one model.

    The message names those that do not, and why.
    """


class Mirrored(BadInput):
    """Raised when photographs are mirrored; the message names them."""


class ViewsApart(NotEnoughSurface):
    """Some views do not show the page that the others show.

    reasons: index of the photograph → why.
    """

    def __init__(self, reasons: Mapping[int, Finding]) -> None:
        super().__init__("; ".join(f"photograph {view + 1}: {why.text}" for view, why in reasons.items()))
        self.reasons = reasons


class CardApart(NotEnoughSurface):
    """The markers of the card are found where no card can have them.

    The cameras are wrong.
    """


class NoPage(NotEnoughSurface):
    """Raised when no sheet of paper is found in the photographs."""


class SheetLost(NotEnoughSurface):
    """Points slide off the sheet that is fitted through them.

    They are not those of one sheet.
    """


class ExtraMissing(LibraryMissing):
    """Raised when pycolmap is not installed."""

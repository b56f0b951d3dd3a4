"""Why a set of photographs cannot be used."""

from __future__ import annotations

from restore.errors import BadInput, LibraryMissing, NotEnoughSurface


class MixedLenses(BadInput):
    """Raised when photographs differ in size or focal length: they are taken for those of one lens."""


class TooFewViews(NotEnoughSurface):
    """Raised when fewer than three photographs join to one model; the message names those that do not, and why."""


class NoPage(NotEnoughSurface):
    """Raised when no sheet of paper is found in the photographs."""


class ExtraMissing(LibraryMissing):
    """Raised when pycolmap is not installed."""

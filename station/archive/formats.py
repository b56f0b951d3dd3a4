"""The formats of `planish export`, apart from what writes them.

Commands and requests name a format before anything heavy is loaded.
"""

from __future__ import annotations

from enum import StrEnum


class Format(StrEnum):
    """A format of delivery."""

    BAGIT = "bagit"
    METS = "mets"
    IIIF = "iiif"
    PDF = "pdf"
    TIFF = "tiff"
    MESH = "mesh"


class Parts(StrEnum):
    """What of an opened book is delivered: leaves, or the whole where it was kept."""

    AUTO = "auto"
    WHOLE = "whole"


class Overlap(StrEnum):
    """What becomes of the strip of the facing page next to the spine."""

    KEEP = "keep"
    TRIM = "trim"

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

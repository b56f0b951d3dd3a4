"""TIFF masters: each page without loss.

With its profile, its resolution and where it comes from.
"""

from __future__ import annotations

from pathlib import Path

from station.archive.volume import Page
from station.images.image_metadata import ImageMetadata
from station.images.pages import read_page
from station.images.tiff import encode_tiff


def encode_master(page: Page, picture: Path) -> bytes:
    """Encode the picture of a page as a TIFF file.

    Raises BadInput when it cannot be read or has no resolution.
    """
    stored = read_page(picture)
    return encode_tiff(stored.image, stored.dpi, ImageMetadata.from_provenance(page.provenance, stored.profile))

"""TIFF masters: each page lossless, with profile, resolution and provenance."""

from __future__ import annotations

from station.archive.volume import Page
from station.images.image_metadata import ImageMetadata
from station.images.pages import StoredPage
from station.images.tiff import encode_tiff


def encode_master(page: Page, stored: StoredPage) -> bytes:
    """Encode the picture of a page as a TIFF file."""
    return encode_tiff(stored.image, stored.dpi, ImageMetadata.from_provenance(page.provenance, stored.profile))

"""Reader of restored pages."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from restore import BadInput
from restore.formats import read_image
from restore.scan import Bytes

KINDS = (".png", ".tif", ".tiff")
HALF_PIXEL_TO_THE_METRE = 0.5 * 0.0254  # in pixels to the inch
NO_SCALE = "give a page that `planish restore` wrote: it has its true resolution in the file"


@dataclass(frozen=True, eq=False)
class StoredPage:
    """Page (h, w, 3) uint8 RGB as it is stored.

    One inch of paper is `dpi` pixels; profile is its ICC profile, if it has one.
    """

    path: Path
    image: Bytes
    dpi: float
    profile: bytes | None = None


def find_pages(path: Path) -> list[Path]:
    """Return the page file itself, or the pages of a folder of results.

    Each is known by the report next to it. Raises BadInput without any page.
    """
    if not path.is_dir():
        if path.suffix.lower() not in KINDS:
            raise BadInput(
                f"{path} is not a page", f"give a file that ends in {', '.join(KINDS)}, or a folder of results"
            )
        return [path]
    pages = [page for report in sorted(path.glob("*.json")) if (page := report.with_suffix(".png")).is_file()]
    if not pages:
        raise BadInput(f"{path} holds no restored page", "give the folder that `planish restore` or `scan` wrote to")
    return pages


def read_page(path: Path) -> StoredPage:
    """Read a page. Raises BadInput when it is missing, damaged or has no resolution."""
    image = read_image(path)
    with warnings.catch_warnings(), Image.open(path) as file:  # it has just been read whole
        warnings.simplefilter("ignore")
        across, up = (float(dots) for dots in file.info.get("dpi", (0, 0)))
        profile = file.info.get("icc_profile")
    if across <= 1 or abs(across - up) > 0.01 * across:  # 1 is what Pillow gives for a TIFF without a unit
        raise BadInput(f"{path} does not say how large the page is", NO_SCALE)
    return StoredPage(path, image, _whole_dpi(across), profile)


def _whole_dpi(dpi: float) -> float:
    """Return the whole number that a PNG cannot express.

    It has whole pixels to the metre, 5906 of them for 150 to the inch.
    """
    return float(round(dpi)) if abs(dpi - round(dpi)) <= HALF_PIXEL_TO_THE_METRE else dpi

"""IIIF: a Presentation 3 manifest of a volume with static tiles.

Its pages are tiles of an Image 3 service, level 0. Level 0 is files alone (IIIF Image API 3.0, 6 and "Image API
compliance"): every size and tile that `info.json` offers is stored under the path that a viewer asks for, in its
canonical form.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from PIL import Image

from restore.scan import Bytes
from station.archive.volume import Page, Volume
from station.errors import UsageError
from station.images.icc import srgb_profile

TILE = 512  # pixels, the side that the API's own examples have; 4 × 3 tiles fill a screen
QUALITY = 90  # of JPEG: masters are in the other formats
IMAGE_CONTEXT = "http://iiif.io/api/image/3/context.json"
PRESENTATION_CONTEXT = "http://iiif.io/api/presentation/3/context.json"
# Addresses that `rights` of a manifest may have; others are metadata.
RIGHTS = tuple(
    f"{scheme}://{host}/" for scheme in ("http", "https") for host in ("creativecommons.org", "rightsstatements.org")
)
NON_PAGED = frozenset({"target", "insert"})
MANIFEST, IMAGES = "manifest.json", "images"
NO_ADDRESS = re.compile(r"[\s<>\"{}|\\^`?#]")  # what no URI has (RFC 3986), and what begins a query or a fragment


def folder_address(text: str) -> str:
    """Return the address of a web folder, without a slash at its end.

    Every address of an export begins with it. Raises UsageError for a text that is not an address.
    """
    try:
        parts = urlsplit(text)
        whole = parts.scheme in ("http", "https") and parts.hostname and (parts.port or True)
    except ValueError:  # invalid port or IPv6 address
        whole = False
    if not whole or parts.query or parts.fragment or NO_ADDRESS.search(text):
        raise UsageError(
            f"--url: {text!r} is not an address of a web folder", "give one as https://example.org/volumes/1"
        )
    return text.rstrip("/")


@dataclass(frozen=True)
class PageImage:
    """Page in the manifest: folder of its image service, size in pixels, dots per inch."""

    page: Page
    folder: str
    width: int
    height: int
    dpi: float


@dataclass(frozen=True)
class Tile:
    """Part of a reduced image: region (x, y, w, h) of the whole, size (w, h), file's path."""

    region: tuple[int, int, int, int]
    size: tuple[int, int]
    path: str


def encode_tiles(image: Bytes, profile: bytes | None = None) -> Iterator[tuple[str, bytes]]:
    """Yield the files of an image, as (path below its service, content).

    `info.json` is not among them.
    image: (h, w, 3) uint8 RGB.
    profile: ICC, sRGB when None.
    """
    height, width = image.shape[:2]
    whole = Image.fromarray(image)
    for factor in scale_factors(width, height):
        size = _reduced(width, height, factor)
        level = whole if factor == 1 else whole.resize(size, Image.Resampling.LANCZOS)
        yield _path("full", "max" if factor == 1 else f"{size[0]},{size[1]}"), _jpeg(level, profile)
        for tile in _tiles(width, height, factor):
            left, top = tile.region[0] // factor, tile.region[1] // factor
            part = level.crop((left, top, left + tile.size[0], top + tile.size[1]))
            yield tile.path, _jpeg(part, profile)


def encode_info(identifier: str, width: int, height: int) -> bytes:
    """The `info.json` of an image of this size. identifier: address of the service."""
    factors = scale_factors(width, height)
    smaller = factors[:0:-1]  # the whole is there as `max` alone
    sizes = [dict(zip(("width", "height"), _reduced(width, height, factor), strict=True)) for factor in smaller]
    return _encode(
        {
            "@context": IMAGE_CONTEXT,
            "id": identifier,
            "type": "ImageService3",
            "protocol": "http://iiif.io/api/image",
            "profile": "level0",
            "width": width,
            "height": height,
            "sizes": sizes,
            "tiles": [{"width": TILE, "height": TILE, "scaleFactors": factors}],
        }
    )


def encode_manifest(volume: Volume, images: Sequence[PageImage], address: str) -> bytes:
    """Encode the manifest of a volume.

    address: of the folder that it is served from, without a slash at its end.
    """
    manifest: dict[str, Any] = {
        "@context": PRESENTATION_CONTEXT,
        "id": f"{address}/{MANIFEST}",
        "type": "Manifest",
        "label": _text(volume.title),
        "metadata": [
            {"label": {"en": [name]}, "value": {"none": list(values)}} for name, values in _metadata(volume) if values
        ],
        "behavior": ["paged" if any(image.page.side for image in images) else "individuals"],
        "items": [_canvas(image, address) for image in images],
    }
    if volume.about.direction:
        manifest["viewingDirection"] = "right-to-left" if volume.is_rtl else "left-to-right"
    if volume.about.rights.startswith(RIGHTS):
        manifest["rights"] = re.sub("^https:", "http:", volume.about.rights)
    owner = volume.about.owner or volume.organisation
    if owner:
        manifest["requiredStatement"] = {"label": {"en": ["Held by"]}, "value": _text(owner)}
        manifest["provider"] = [{"id": f"{address}/#provider", "type": "Agent", "label": _text(owner)}]
    if ranges := list(_ranges(volume, {image.page.number for image in images}, address)):
        manifest["structures"] = ranges
    return _encode(manifest)


def _metadata(volume: Volume) -> Iterator[tuple[str, Sequence[str]]]:
    """Yield what is known of a volume, with the names that a viewer shows."""
    about = volume.about
    yield "Identifier", [volume.identifier, *(one.value for one in about.identifiers)]
    yield "Collection", list(filter(None, [volume.project]))
    yield "Creator", about.creators
    for name in ("date", "place", "publisher", "language", "shelfmark", "extent"):
        yield name.capitalize(), list(filter(None, [getattr(about, name)]))
    yield "Rights", [] if about.rights.startswith(RIGHTS) or not about.rights else [about.rights]


def _ranges(volume: Volume, shown: Collection[int], address: str) -> Iterator[Mapping[str, Any]]:
    """Yield a range for each section of which pages are shown."""
    for number, section in enumerate(volume.sections, 1):
        pages = [page for page in section.pages if page in shown]
        canvases = [{"id": f"{address}/canvas/{page:04}", "type": "Canvas"} for page in pages]
        if canvases:
            yield {
                "id": f"{address}/range/{number}",
                "type": "Range",
                "label": _text(section.label),
                "items": canvases,
            }


def scale_factors(width: int, height: int) -> list[int]:
    """1, 2, 4, … down to the reduction at which the image is one tile."""
    factors = [1]
    while max(_reduced(width, height, factors[-1])) > TILE:
        factors.append(2 * factors[-1])
    return factors


def _tiles(width: int, height: int, factor: int) -> Iterator[Tile]:
    """Yield the tiles of a reduction, without the whole image.

    That is offered as a size.
    """
    side = TILE * factor
    if width <= side and height <= side:
        return
    for y in range(0, height, side):
        for x in range(0, width, side):
            region = (x, y, min(side, width - x), min(side, height - y))
            size = _reduced(*region[2:], factor)
            yield Tile(region, size, _path(",".join(map(str, region)), f"{size[0]},{size[1]}"))


def _canvas(image: PageImage, address: str) -> Mapping[str, Any]:
    number = f"{image.page.number:04}"
    canvas, service = f"{address}/canvas/{number}", f"{address}/{image.folder}"
    small = _reduced(image.width, image.height, scale_factors(image.width, image.height)[-1])
    services = [{"id": service, "type": "ImageService3", "profile": "level0"}]
    kind = "facing-pages" if image.page.is_spread else "non-paged" if image.page.kind in NON_PAGED else ""
    return {
        **({"behavior": [kind]} if kind else {}),
        "id": canvas,
        "type": "Canvas",
        **({"label": _text(image.page.label)} if image.page.label else {}),  # it should have one, and need not
        "height": image.height,
        "width": image.width,
        "thumbnail": [
            {
                "id": f"{service}/{_path('full', _size_name(small, image))}",
                "type": "Image",
                "format": "image/jpeg",
                "width": small[0],
                "height": small[1],
                "service": services,
            }
        ],
        "metadata": [{"label": {"en": ["Resolution"]}, "value": _text(f"{image.dpi:g} pixels to the inch of paper")}],
        "items": [
            {
                "id": f"{canvas}/page",
                "type": "AnnotationPage",
                "items": [
                    {
                        "id": f"{canvas}/painting",
                        "type": "Annotation",
                        "motivation": "painting",
                        "target": canvas,
                        "body": {
                            "id": f"{service}/{_path('full', 'max')}",
                            "type": "Image",
                            "format": "image/jpeg",
                            "height": image.height,
                            "width": image.width,
                            "service": services,
                        },
                    }
                ],
            }
        ],
    }


def _size_name(size: tuple[int, int], image: PageImage) -> str:
    return "max" if size == (image.width, image.height) else f"{size[0]},{size[1]}"


def _reduced(width: int, height: int, factor: int) -> tuple[int, int]:
    return -(-width // factor), -(-height // factor)


def _path(region: str, size: str) -> str:
    return f"{region}/{size}/0/default.jpg"


def _text(text: str) -> dict[str, list[str]]:
    """A text of no language (Presentation API 3.0, 4.1)."""
    return {"none": [text]}


def _jpeg(image: Image.Image, profile: bytes | None) -> bytes:
    out = io.BytesIO()
    image.save(out, "JPEG", quality=QUALITY, icc_profile=profile or srgb_profile())
    return out.getvalue()


def _encode(value: Mapping[str, Any]) -> bytes:
    return (json.dumps(value, indent=1, ensure_ascii=False) + "\n").encode("utf-8", "backslashreplace")

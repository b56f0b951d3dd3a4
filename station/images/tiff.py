"""TIFF of the page, and of the map of source pixels.

The page has resolution, colour profile and metadata.
"""

from __future__ import annotations

import io
import json
import zlib
from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from restore import RestoredPage
from restore.runtime import Rows, in_threads
from restore.scan import Bytes
from station.images.image_metadata import ImageMetadata, exif_time

MAKE, MODEL, ORIENTATION, XMP = 271, 272, 274, 700  # of TIFF 6.0, section 8, and of XMP specification part 3, 2.1
MAKERS = {"vivid": "Minolta"}  # of devices by how their names begin
UPRIGHT = 1  # the first row is the top
STRIP_BYTES = 2**18  # of a strip before it is compressed, as tifffile has them
MAX_BYTES = 2**32 - 2**25  # of a TIFF that is not a BigTIFF, with room for its tags: tifffile's own limit
AT_ONCE = 64  # strips that are compressed before any is written


def encode_tiff(image: Bytes, dpi: float, metadata: ImageMetadata | None = None) -> bytes:
    """Encode a page (h, w, 3) uint8 RGB as a TIFF file, as `write_tiff` writes it."""
    out = io.BytesIO()
    write_tiff(image, dpi, metadata, out)
    return out.getvalue()


def write_tiff(image: Bytes | Rows, dpi: float, metadata: ImageMetadata | None, file: BinaryIO) -> None:
    """Write a page (h, w, 3) uint8 RGB to a TIFF file.

    Losslessly compressed in strips of rows, a BigTIFF above 4 GB, one inch of paper being `dpi` pixels. One that is
    drawn by rows is never in memory whole.
    """
    rows = image if isinstance(image, Rows) else Rows.of(image)
    height, width = rows.shape[:2]
    strip = max(1, min(STRIP_BYTES // (3 * width), height))
    tags = {} if metadata is None else _tags(metadata)
    known = {"shape": (height, width, 3), "dtype": np.uint8, "rowsperstrip": strip}
    _write(file, _strips(rows, strip), dpi, photometric="rgb", bigtiff=3 * width * height > MAX_BYTES, **known, **tags)


def _strips(picture: Rows, rows: int) -> Iterator[bytes]:
    """Yield each strip of some rows, compressed in threads, AT_ONCE of them at a time."""
    for top in range(0, picture.shape[0], AT_ONCE * rows):
        some = np.ascontiguousarray(picture.rows(slice(top, min(top + AT_ONCE * rows, picture.shape[0]))))
        yield from in_threads(zlib.compress, [some[start : start + rows].data for start in range(0, len(some), rows)])


def _tags(metadata: ImageMetadata) -> dict[str, Any]:
    xmp = metadata.xmp()
    extra: list[tuple[Any, ...]] = [(ORIENTATION, "H", 1, UPRIGHT, True), (XMP, "B", len(xmp), xmp, True)]
    if metadata.device is not None:
        device = metadata.device.encode("ascii", "replace").decode()
        extra.append((MODEL, "s", 0, device, True))
        makers = [maker for model, maker in MAKERS.items() if device.lower().startswith(model)]
        extra += [(MAKE, "s", 0, maker, True) for maker in makers]
    time = {} if metadata.time is None else {"datetime": exif_time(metadata.time)}
    return {"iccprofile": metadata.profile, "software": metadata.software, "extratags": extra, **time}


def encode_map(page: RestoredPage) -> bytes:
    """Encode the page's map as a TIFF of two channels (h, w) float32.

    They are x and y of the source pixel that each page pixel shows, x to the right, y down, the centre of the top left
    source pixel being (0, 0), NaN outside the page. A page textured from photographs has a third channel, the number of
    the source, and the description lists the sources by number; pixels of a photograph are counted in the upright
    picture.
    """
    channels, layers = ["source x", "source y"], [page.page_map]
    description_fields: dict[str, Any] = {"unit": "source pixel", "outside": "NaN"}
    if page.page_source is not None:
        channels.append("source")
        number = np.where(np.isnan(page.page_map[..., 0]), np.nan, page.page_source).astype(np.float32)
        layers.append(number[..., None])
        description_fields["sources"] = ["the scan's colour image", *(photo["name"] for photo in page.report["photos"])]
    description = json.dumps({"channels": channels, **description_fields})
    return _encode(np.concatenate(layers, axis=2), page.dpi, photometric="minisblack", description=description)


def encode_uncertainty(uncertainty: NDArray[np.float32], dpi: float) -> bytes:
    """Encode the uncertainty (h, w) float32 mm of a page as a TIFF of one channel."""
    description = json.dumps({"channels": ["standard deviation along either axis"], "unit": "mm", "outside": "NaN"})
    return _encode(uncertainty, dpi, photometric="minisblack", description=description)


def _encode(array: NDArray[Any], dpi: float, **tags: Any) -> bytes:
    out = io.BytesIO()
    _write(out, array, dpi, **tags)
    return out.getvalue()


def _write(file: BinaryIO, data: Any, dpi: float, **tags: Any) -> None:
    import tifffile

    resolution = {"resolution": (dpi, dpi), "resolutionunit": "INCH"}
    tifffile.imwrite(file, data, compression="zlib", planarconfig="contig", metadata=None, **resolution, **tags)

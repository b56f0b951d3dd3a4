"""TIFF: the page with its resolution tag, and the map of where every pixel came from."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.scan import Bytes


def encode_tiff(image: Bytes, dpi: float) -> bytes:
    """The page (h, w, 3) uint8 RGB as a TIFF file, losslessly compressed, one inch of paper being `dpi` pixels."""
    return _encode(image, dpi, photometric="rgb")


def encode_map(page_map: NDArray[np.float32], dpi: float) -> bytes:
    """The map (h, w, 2) float32 as a TIFF of two channels: x and y of the source pixel that each page pixel shows.

    x to the right, y down, the centre of the top left source pixel is (0, 0), NaN outside the page.
    """
    description = json.dumps({"channels": ["source x", "source y"], "unit": "source pixel", "outside": "NaN"})
    return _encode(page_map, dpi, photometric="minisblack", description=description)


def _encode(array: NDArray[Any], dpi: float, **tags: Any) -> bytes:
    import tifffile

    out = io.BytesIO()
    resolution = {"resolution": (dpi, dpi), "resolutionunit": "INCH"}
    tifffile.imwrite(out, array, compression="zlib", planarconfig="contig", metadata=None, **resolution, **tags)
    return out.getvalue()

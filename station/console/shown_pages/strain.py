"""The strain of a page as a layer.

Each tile is drawn from the mesh on demand, so that no page is too large.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from restore.drawing import rasterise
from restore.scan import Bytes, Floats, Ints, Mask
from station.console.shown_pages.layers import file_of_layer, opened, read_model, stored_file
from station.console.shown_pages.tiles import Box, Pyramid, Size
from station.pictures.strain import SIGNED, round_up
from station.session import Event, Session

SHOWN_PERCENT = 99.0  # of the values are within the scale: a single sliver or corner must not hide the rest
OPACITY = 190
COLOURS = 256  # between the ends of the scale


class StrainPyramid(Pyramid):
    """Stretch over the page, blue to red, (h, w, 4) uint8, transparent where unknown.

    uv: (n, 2), positions on the picture of the page, 0 to 1, v upwards.
    faces: (m, 3).
    strain: (n,).
    """

    def __init__(self, size: Size, uv: Floats, faces: Ints, strain: Floats) -> None:
        super().__init__(size)
        self._uv, self._faces, self._strain = uv, faces, np.ascontiguousarray(strain[:, None])
        self._end = end_of_scale(strain)

    @property
    def nbytes(self) -> int:
        """Bytes of the mesh: no tile is kept."""
        return self._uv.nbytes + self._faces.nbytes + self._strain.nbytes

    def region(self, level: int, box: Box) -> Bytes:
        """The pixels (h, w, 4) of a box of a level."""
        width, height = self.sizes[level]
        left, top, right, bottom = box
        u, v = self._uv.T
        xy = np.column_stack([u * width - 0.5 - left, (1.0 - v) * height - 0.5 - top])
        found = rasterise(xy, self._faces, self._strain, bottom - top, right - left)[..., 0]
        return coloured(np.nan_to_num(found) / self._end / 2.0 + 0.5, np.isfinite(found), SIGNED)


def strain_pyramid(session: Session, event: Event, prefix: str = "") -> StrainPyramid:
    """The strain of a page or leaf of a restoration. Raises ConsoleFault, BadInput, OSError."""
    arrays, _ = read_model(session, event, file_of_layer(f"{prefix}strain"))
    with opened(stored_file(session, event, file_of_layer(f"{prefix}page"))) as picture:
        size = picture.size
    names = ("page_uv", "faces", "strain")
    uv, faces, strain = (arrays[name].astype(kind) for name, kind in zip(names, ("f8", "i8", "f8"), strict=True))
    return StrainPyramid(size, uv, faces, strain)


def strain_scale(strain: Floats) -> dict[str, Any]:
    """Return the scale of the strain (n,).

    Its ends, the colours along it, and what the numbers are.
    """
    return {
        "unit": "fraction",
        "stretch": {"min": float(strain.min()), "max": float(strain.max()), "rms": float(np.sqrt((strain**2).mean()))},
        "end": end_of_scale(strain),
        "colours": hexadecimal(SIGNED),
    }


def coloured(fraction: NDArray[np.floating[Any]], known: Mask, colours: Floats) -> Bytes:
    """Colour fractions (h, w) of a scale as a picture (h, w, 4).

    known: (h, w), where it is not transparent.
    colours: (k, 3), along the scale.
    """
    anchors = np.linspace(0.0, COLOURS - 1.0, len(colours))
    channels = [np.interp(np.arange(COLOURS), anchors, channel) for channel in colours.T]
    table = np.column_stack([*channels, np.full(COLOURS, OPACITY)]).astype(np.uint8)
    picture = table[np.rint(np.clip(fraction, 0.0, 1.0) * (COLOURS - 1)).astype(np.uint8)]
    picture[~known, 3] = 0
    return picture


def hexadecimal(colours: Floats) -> list[str]:
    """Return colours (k, 3) as a page of the web has them."""
    return ["#{:02x}{:02x}{:02x}".format(*colour.astype(int)) for colour in colours]


def end_of_scale(values: Floats) -> float:
    """Return the greatest value of the colours, of values (…) of either sign, or NaN.

    >>> end_of_scale(np.array([[0.003, 0.011, np.nan]]))
    0.02
    """
    known = np.abs(values[np.isfinite(values)])
    return round_up(float(np.percentile(known, SHOWN_PERCENT)) if known.size else 0.0)

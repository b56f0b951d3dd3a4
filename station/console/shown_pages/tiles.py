"""Deep Zoom pyramids of pictures, made on demand and kept in memory up to a limit."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Hashable, Sequence
from math import ceil, log2

import cv2
import numpy as np

from restore.scan import Bytes
from station.console.faults import ConsoleFault

TILE, OVERLAP = 256, 1  # pixels, as OpenSeadragon expects them
MAX_KEPT_BYTES = 384 * 2**20  # of pyramids: some forty pages at 150 dpi
THUMBNAIL = 240  # pixels
MAX_WHOLE_PIXELS = 2**24  # of a picture that is drawn as a whole: 64 MB
KINDS = {
    "page": "jpg",
    "master": "jpg",
    "original": "jpg",
    "strain": "png",
    "coverage": "png",
    "uncertainty": "png",
}


Size = tuple[int, int]
"""Width and height."""
Box = tuple[int, int, int, int]
"""Left, top, right and bottom pixel, the last two excluded."""


class Pyramid(ABC):
    """Picture at every level, (h, w, 3 or 4) uint8.

    The last level is the whole, each before it half as large.
    """

    def __init__(self, size: Size) -> None:
        self.size = size
        steps = range(ceil(log2(max(*size, 1))), -1, -1)
        self.sizes = [(ceil(size[0] / 2**step), ceil(size[1] / 2**step)) for step in steps]

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """Bytes that are kept."""

    @abstractmethod
    def region(self, level: int, box: Box) -> Bytes:
        """The pixels (h, w, 3 or 4) of a box of a level."""

    def whole(self) -> Bytes:
        """Return the picture (h, w, 3 or 4) at its last level within MAX_WHOLE_PIXELS."""
        level = max(n for n, (width, height) in enumerate(self.sizes) if width * height <= MAX_WHOLE_PIXELS)
        return self.region(level, (0, 0, *self.sizes[level]))

    def thumbnail(self) -> Bytes:
        """The picture (h, w, 3 or 4) within THUMBNAIL pixels."""
        level = next(n for n, size in enumerate(self.sizes) if max(size) >= min(THUMBNAIL, max(self.size)))
        above = self.region(level, (0, 0, *self.sizes[level]))
        scale = min(THUMBNAIL / max(above.shape[:2]), 1.0)
        size = max(round(above.shape[1] * scale), 1), max(round(above.shape[0] * scale), 1)
        return np.asarray(cv2.resize(above, size, interpolation=cv2.INTER_AREA))

    def tile(self, level: int, column: int, row: int) -> Bytes:
        """Return one tile (h, w, 3 or 4), with the overlap of its neighbours.

        Raises ConsoleFault when it does not exist.
        """
        if not 0 <= level < len(self.sizes):
            raise ConsoleFault("not_found", f"the level {level} does not exist")
        width, height = self.sizes[level]
        if not (0 <= column < ceil(width / TILE) and 0 <= row < ceil(height / TILE)):
            raise ConsoleFault("not_found", f"level {level} has no tile {column}, {row}")
        left, top = max(column * TILE - OVERLAP, 0), max(row * TILE - OVERLAP, 0)
        right, bottom = min((column + 1) * TILE + OVERLAP, width), min((row + 1) * TILE + OVERLAP, height)
        return self.region(level, (left, top, right, bottom))


class StoredPyramid(Pyramid):
    """A pyramid whose levels are kept: the last one is the whole."""

    def __init__(self, levels: Sequence[Bytes]) -> None:
        height, width = levels[-1].shape[:2]
        super().__init__((width, height))
        self.levels = tuple(levels)

    @property
    def nbytes(self) -> int:
        """Bytes of all levels."""
        return sum(level.nbytes for level in self.levels)

    def region(self, level: int, box: Box) -> Bytes:
        """The pixels (h, w, 3 or 4) of a box of a level."""
        left, top, right, bottom = box
        return self.levels[level][top:bottom, left:right]

    def whole(self) -> Bytes:
        """The last level (h, w, 3 or 4)."""
        return self.levels[-1]


def build_pyramid(picture: Bytes) -> StoredPyramid:
    """Return the levels of a picture (h, w, 3 or 4) uint8, from one pixel on.

    Level n is ⌈size / 2^(last − n)⌉.
    """
    height, width = picture.shape[:2]
    levels = [picture]
    for step in range(1, ceil(log2(max(height, width, 1))) + 1):
        size = ceil(width / 2**step), ceil(height / 2**step)
        levels.append(np.asarray(cv2.resize(levels[-1], size, interpolation=cv2.INTER_AREA)))
    return StoredPyramid(levels[::-1])


def describe(pyramid: Pyramid, kind: str) -> str:
    """The .dzi document of a picture."""
    width, height = pyramid.size
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<Image xmlns="http://schemas.microsoft.com/deepzoom/2008" Format="{kind}" Overlap="{OVERLAP}" '
        f'TileSize="{TILE}"><Size Width="{width}" Height="{height}"/></Image>\n'
    )


class Pyramids:
    """The pyramids that were asked for last, within a limit of memory.

    Its methods may be called from any thread.
    """

    def __init__(self, limit: int = MAX_KEPT_BYTES) -> None:
        self._limit = limit
        self._kept: OrderedDict[Hashable, Pyramid] = OrderedDict()
        self._lock = threading.Lock()
        self._building: dict[Hashable, threading.Lock] = {}

    @property
    def nbytes(self) -> int:
        """Bytes that are kept."""
        return sum(pyramid.nbytes for pyramid in self._kept.values())

    def get(self, key: Hashable, build: Callable[[], Pyramid]) -> Pyramid:
        """The pyramid of a key, built when it is not kept."""
        with self._lock:
            found = self._found(key)
            building = self._building.setdefault(key, threading.Lock())
        if found is not None:
            return found
        with building:
            with self._lock:
                found = self._found(key)
            if found is None:
                found = build()
                with self._lock:
                    self._keep(key, found)
        return found

    def _found(self, key: Hashable) -> Pyramid | None:
        found = self._kept.get(key)
        if found is not None:
            self._kept.move_to_end(key)
        return found

    def _keep(self, key: Hashable, pyramid: Pyramid) -> None:
        self._kept[key] = pyramid
        self._building.pop(key, None)
        while len(self._kept) > 1 and self.nbytes > self._limit:
            self._kept.popitem(last=False)

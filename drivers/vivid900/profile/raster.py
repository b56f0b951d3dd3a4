"""Codecs of images: bytes ↔ named channels, each (rows, cols).

One is built in, others are small plug-ins.
"""

from __future__ import annotations

import runpy
from collections.abc import Mapping, Sequence
from functools import cache, reduce
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from drivers.scanner import SettingsError
from drivers.vivid900.profile.template import Order

Kind = Literal["u1", "u2", "u4"]
Layout = Literal["interleaved", "lines", "planar"]
Channel = NDArray[np.unsignedinteger[Any]]
PAD = "pad"
"""Name of bytes between channels that mean nothing."""


class Codec(Protocol):
    """An image as bytes, header excluded."""

    def length(self, rows: int, cols: int) -> int:
        """Bytes of an image."""
        ...

    def encode(self, channels: Mapping[str, Channel]) -> bytes:
        """The bytes of channels (rows, cols). Only the simulated scanner needs it."""
        ...

    def decode(self, data: bytes, rows: int, cols: int) -> Mapping[str, Channel]:
        """Return the channels (rows, cols) in `length(rows, cols)` bytes.

        Raises ValueError for bytes that are not an image.
        """
        ...


class Raster:
    """Rows of samples of fixed width.

    pixel    the channels and their widths in their order; PAD may occur more than once.
    layout   interleaved: sample after sample with all channels; lines: in each row channel after channel; planar: one
             whole channel after the other.
    row_pad  bytes after every row (of every channel, when planar) that mean nothing.
    """

    def __init__(
        self,
        pixel: Sequence[tuple[str, Kind]],
        *,
        order: Order = "big",
        layout: Layout = "interleaved",
        row_pad: int = 0,
    ) -> None:
        mark = ">" if order == "big" else "<"
        self._kinds = [(f"{PAD}{i}" if name == PAD else name, mark + kind) for i, (name, kind) in enumerate(pixel)]
        self._names = [name for name, _ in pixel if name != PAD]
        self._layout, self._row_pad = layout, row_pad

    def length(self, rows: int, cols: int) -> int:
        """See Codec."""
        return self._image(rows, cols).itemsize

    def encode(self, channels: Mapping[str, Channel]) -> bytes:
        """See Codec. Raises SettingsError when a value does not fit into its bytes."""
        image = np.zeros((), self._image(*channels[self._names[0]].shape))
        for name in self._names:
            values, place = channels[name], self._channel(image, name)
            if values.size and values.max() > np.iinfo(place.dtype).max:
                raise SettingsError(f"a {name} of {values.max()} does not fit into the profile's pixel")
            place[...] = values
        return image.tobytes()

    def decode(self, data: bytes, rows: int, cols: int) -> dict[str, Channel]:
        """See Codec."""
        image = np.frombuffer(data, self._image(rows, cols))[0]
        return {name: self._channel(image, name) for name in self._names}

    def _image(self, rows: int, cols: int) -> np.dtype[Any]:
        """The whole image as one record."""
        pad = ("row_pad", np.uint8, (self._row_pad,))
        if self._layout == "planar":
            lines = [(name, np.dtype([("samples", kind, (cols,)), pad])) for name, kind in self._kinds]
            return np.dtype([(name, line, (rows,)) for name, line in lines])
        if self._layout == "lines":
            line = np.dtype([*((name, kind, (cols,)) for name, kind in self._kinds), pad])
        else:
            line = np.dtype([("samples", np.dtype(self._kinds), (cols,)), pad])
        return np.dtype([("lines", line, (rows,))])

    def _channel(self, image: Any, name: str) -> Channel:
        """The samples (rows, cols) of a channel in the record, not copied."""
        path = {"interleaved": ("lines", "samples", name), "lines": ("lines", name), "planar": (name, "samples")}
        return reduce(lambda part, key: part[key], path[self._layout], image)


@cache
def load_codec(file: str) -> Codec:
    """The object CODEC of a Python file, which is run. Raises SettingsError."""
    try:
        codec: Codec = runpy.run_path(file)["CODEC"]
    except Exception as error:  # whatever a file of the owner's own raises
        hint = "the file has to define CODEC, an object with length, encode and decode"
        raise SettingsError(f"cannot use the codec {Path(file).name}: {error!r}", hint) from error
    return codec

"""An example of a codec: planes of 32-bit differences along the row, modulo 2³², then the brightness.

A profile names such a file with `codec` in [pitch] or [colour]. It defines CODEC, an object with the three functions
below; channels are arrays (rows, cols) of unsigned integers, by the names that the profile's `pixel` uses.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np


class Differences:
    """Planes sum, moment and intensity."""

    def length(self, rows: int, cols: int) -> int:
        """Bytes of an image."""
        return 9 * rows * cols

    def encode(self, channels: Mapping[str, Any]) -> bytes:
        """The bytes of an image, for the simulated scanner."""
        planes = [np.diff(channels[name].astype(np.uint32), axis=1, prepend=np.uint32(0)) for name in ("sum", "moment")]
        return (
            b"".join(plane.astype(">u4").tobytes() for plane in planes) + channels["intensity"].astype("u1").tobytes()
        )

    def decode(self, data: bytes, rows: int, cols: int) -> dict[str, Any]:
        """The channels of an image."""
        planes = np.frombuffer(data, ">u4", 2 * rows * cols).reshape(2, rows, cols).astype(np.uint32)
        total, moment = np.cumsum(planes, axis=2, dtype=np.uint32)
        intensity = np.frombuffer(data, "u1", offset=8 * rows * cols).reshape(rows, cols)
        return {"sum": total, "moment": moment, "intensity": intensity}


CODEC = Differences()

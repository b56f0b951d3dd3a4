"""Guesses how the images of a capture are packed, by decoding them in every plausible way.

The stripe moves down by one row of the range image from frame to frame, so that on any surface without steps a sample's
frame is one more than that of the sample above it. In a picture neighbouring pixels are alike, channel by channel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np

from drivers.trace.groups import Group
from drivers.trace.roles import Shape, colour_shape, pitch_shape
from drivers.vivid900.profile.encodings import NOT_MEASURED
from drivers.vivid900.profile.raster import PAD, Channel, Kind, Layout, Raster
from drivers.vivid900.profile.template import Order
from restore.scan import Floats

ENOUGH = 0.5  # fraction of samples one frame below their neighbour; wrongly packed, hardly any are
STEP = 0.5, 1.5  # frames
FRACTION_BITS = range(0, 25)
ORDERS: tuple[Order, ...] = ("big", "little")
LAYOUTS: tuple[Layout, ...] = ("interleaved", "lines", "planar")
Pixel = tuple[tuple[str, Kind], ...]
PADDING: dict[int, tuple[Kind, ...]] = {0: (), 1: ("u1",), 2: ("u2",), 3: ("u1", "u2"), 4: ("u4",)}


@dataclass(frozen=True)
class Packing:
    """A way to pack an image that fits: the table in a profile, and how well it fits."""

    table: dict[str, Any]
    evidence: str


def pitch_packing(kind: Group) -> Packing | None:
    """Return how a command's range images are packed, None when nothing plausible fits."""
    shape = pitch_shape(kind)
    data = None if shape is None else _samples(kind, shape)
    if shape is None or data is None:
        return None
    fraction, table = max(_pitch_fractions(data, shape), key=lambda found: found[0], default=(0.0, {}))
    return (
        Packing(table, f"{fraction:.0%} of the samples are one frame below their neighbour")
        if fraction > ENOUGH
        else None
    )


def _pitch_fractions(data: bytes, shape: Shape) -> Iterator[tuple[float, dict[str, Any]]]:
    for pixel in _pixels(shape.sample):
        for order in ORDERS:
            for layout in LAYOUTS if len(pixel) > 1 else LAYOUTS[:1]:
                channels = Raster(pixel, order=order, layout=layout).decode(data, shape.rows, shape.cols)
                table = {"order": order, "layout": layout, "pixel": [list(channel) for channel in pixel]}
                for fraction_bits, frames in _frames(channels):
                    yield _fraction_of_steps(frames), table | fraction_bits


def _pixels(sample: int) -> Iterator[Pixel]:
    """Yield the channels that a sample of `sample` bytes may have.

    Without padding first, then with padding at its end.
    """
    wholes: list[Pixel] = [
        (("sum", "u4"), ("moment", "u4"), ("intensity", "u1")),
        (("sum", "u4"), ("moment", "u4")),
        (("frame", "u4"), ("intensity", "u1")),
        (("frame", "u4"),),
    ]
    for whole in wholes:
        spare = sample - sum(int(kind[1]) for _, kind in whole)
        if spare in PADDING:
            yield from (order + tuple((PAD, kind) for kind in PADDING[spare]) for order in permutations(whole))


def _frames(channels: dict[str, Channel]) -> Iterator[tuple[dict[str, int], Floats]]:
    """Frames (rows, cols) by every fraction that there may be, NaN without light."""
    if "frame" in channels:
        word = np.where(channels["frame"] == NOT_MEASURED, np.nan, channels["frame"].astype(float))
        yield from (({"fraction_bits": bits}, word / (1 << bits)) for bits in FRACTION_BITS)
    else:
        light = channels["sum"].astype(float)
        yield {}, np.divide(channels["moment"], light, out=np.full(light.shape, np.nan), where=light > 0)


def _fraction_of_steps(frames: Floats) -> float:
    step = np.diff(frames, axis=0)
    pairs = np.isfinite(step)
    return float(((step > STEP[0]) & (step < STEP[1])).sum() / pairs.sum()) if pairs.any() else 0.0


def colour_packing(kind: Group) -> Packing | None:
    """Return how the colour images of a kind of command are packed.

    Whichever channel is which; None without an image.
    """
    shape = colour_shape(kind)
    data = None if shape is None else _samples(kind, shape)
    if shape is None or data is None:
        return None
    rough = []
    for names in ("RGB",) if shape.sample == 3 else ("RGBX", "XRGB"):
        for layout in LAYOUTS:
            pixel: Pixel = tuple((name, "u1") for name in names)
            channels = Raster(pixel, layout=layout).decode(data, shape.rows, shape.cols)
            planes = [plane.astype(float) for plane in channels.values()]
            differences = [np.abs(np.diff(plane, axis=axis)).mean() for plane in planes for axis in (0, 1)]
            rough.append((float(np.sum(differences)), {"layout": layout, "channels": names}))
    least, table = min(rough, key=lambda found: found[0])
    return Packing(
        table, f"neighbouring pixels differ by {least / 6:.1f} of 255; the order of the channels cannot be determined"
    )


def _samples(kind: Group, shape: Shape) -> bytes | None:
    """The samples of the last whole block of the largest length."""
    for block in reversed(kind.blocks):
        data = b"".join(piece.data for piece in block)
        if len(data) == kind.largest:
            return data[shape.header :]
    return None

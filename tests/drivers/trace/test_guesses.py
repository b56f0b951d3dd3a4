"""What the draft finds out by itself: checksums, the state of the scanner, and how images are packed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.trace.checksums import ENOUGH_BYTES, find_checksum
from drivers.trace.exchanges import Exchange
from drivers.trace.groups import Group
from drivers.trace.pixels import colour_packing, pitch_packing
from drivers.vivid900.profile.encodings import NOT_MEASURED
from drivers.vivid900.profile.raster import Raster
from drivers.vivid900.profile.template import CHECKSUMS, Checksum, Template

READ, STATUS, RELEASE = bytes.fromhex("C5" + 9 * "00"), bytes.fromhex("C4" + 9 * "00"), bytes.fromhex("C3" + 9 * "00")


def said(cdb: bytes, data: bytes = b"", number: int = 0) -> Exchange:
    direction = "in" if data else "none"
    return Exchange((1, 5), 0, cdb, direction, len(data), len(data), data, "good", number=number)


@given(st.sampled_from(sorted(CHECKSUMS)), st.integers(0, 6), st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_a_checksum_is_found_where_it_is(kind, at, seed):
    rng = np.random.default_rng(seed)
    true = Template(length=12, checksum=Checksum(kind=kind, at=at))
    blocks = [true.build({}, base=rng.bytes(12)) + rng.bytes(20) for _ in range(8)]
    blocks = [true.build({}, rng.bytes(20), base=block[:12]) for block in blocks]
    found = find_checksum(blocks, header=12)
    assert found is not None
    assert all(found.span.read(block, "big") == found.of(block) for block in blocks)
    assert found.kind == kind
    assert found.at == (11 if kind == "xor8" else at)  # of an exclusive or every byte is that of all others


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=50)
def test_random_bytes_have_none(seed):
    rng = np.random.default_rng(seed)
    assert find_checksum([rng.bytes(16) for _ in range(ENOUGH_BYTES)], header=16) is None
    assert find_checksum([bytes(16)] * 9, header=16) is None  # one block, however often, proves nothing


def swept(rows: int, cols: int) -> np.ndarray:
    """Frames of a tilted plate: one more from row to row, and a slope along them."""
    return np.arange(rows)[:, None] + 40.0 + 0.05 * np.arange(cols)


SUMS = (("sum", "u4"), ("moment", "u4"), ("intensity", "u1"))


@pytest.mark.parametrize("order", ["big", "little"])
@pytest.mark.parametrize("layout", ["interleaved", "lines", "planar"])
@pytest.mark.parametrize(
    "pixel", [SUMS, SUMS[::-1], (*SUMS[:2], ("pad", "u4")), (("frame", "u4"), ("intensity", "u1"))]
)
def test_the_packing_of_a_range_image_is_found(pixel, layout, order):
    frames, light = swept(240, 320), np.full((240, 320), 700, np.uint32)
    word = np.where(frames > 270, NOT_MEASURED, np.rint(frames * 2**12)).astype(np.uint32)
    channels = {"sum": light, "moment": np.rint(light * frames).astype(np.uint32), "frame": word}
    channels["intensity"] = np.full((240, 320), 60, np.uint8)
    data = bytes(10) + Raster(pixel, order=order, layout=layout).encode(channels)
    found = pitch_packing(Group((said(READ, data),)))
    assert found is not None
    assert (found.table["order"], found.table["layout"]) == (order, layout)
    kinds = tuple(map(tuple, found.table["pixel"]))
    assert [name for name, _ in kinds if name in ("sum", "moment", "frame")] == [
        name for name, _ in pixel if name in ("sum", "moment", "frame")
    ]
    assert found.table.get("fraction_bits", 12) == 12


def test_noise_is_not_a_range_image():
    data = np.random.default_rng(4).bytes(240 * 320 * 9)
    assert pitch_packing(Group((said(READ, data),))) is None
    assert pitch_packing(Group((said(READ, data[:5000]),))) is None


@pytest.mark.parametrize("layout", ["interleaved", "lines", "planar"])
def test_the_packing_of_a_colour_image_is_found(layout):
    x = np.linspace(0, 1, 640) * np.ones((480, 1))
    channels = {"R": 255 * x, "G": 120 * (1 - x), "B": 20 + 10 * x.round()}
    channels = {name: plane.astype(np.uint8) for name, plane in channels.items()}
    data = Raster([(name, "u1") for name in "RGB"], layout=layout).encode(channels)
    assert colour_packing(Group((said(READ, data),))).table["layout"] == layout
    assert colour_packing(Group((said(READ, data[:5000]),))) is None

"""Codecs of images: what is packed is unpacked, by hand, in every layout and by a plug-in."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from drivers.scanner import SettingsError
from drivers.vivid900.profile.encodings import ColourEncoding, PitchEncoding
from drivers.vivid900.profile.profile import PROFILES
from drivers.vivid900.profile.raster import Raster, load_codec


def test_a_profile_picks_its_codec() -> None:
    pixel = (("frame", "u4"), ("pad", "u2"))
    assert PitchEncoding(pixel=pixel, row_pad=2).image.length(3, 5) == 3 * (5 * 6 + 2)
    assert PitchEncoding(pixel=pixel, fraction_bits=4).fraction == 16
    colour = ColourEncoding(channels="BGRX", layout="planar", row_pad=1)
    assert colour.image("RGB", "u2").length(3, 5) == 4 * 3 * (5 * 2 + 1)
    assert colour.image("L", "u1").length(3, 5) == 3 * (5 + 1)  # one channel, and nothing to fill up


def codecs() -> Iterator[tuple[str, object]]:
    pixel = (("sum", "u4"), ("pad", "u1"), ("moment", "u4"), ("intensity", "u1"), ("pad", "u2"))
    for layout in ("interleaved", "lines", "planar"):
        for order in ("big", "little"):
            yield f"{layout}-{order}", Raster(pixel, order=order, layout=layout, row_pad=3)
    yield "plug-in", load_codec(str(PROFILES / "variants" / "differences.py"))


@pytest.mark.parametrize(("name", "codec"), list(codecs()), ids=lambda value: value if isinstance(value, str) else "")
def test_codecs_give_back_what_they_pack(name, codec) -> None:
    rng = np.random.default_rng(5)
    channels = {name: rng.integers(0, 2**32, (7, 5), np.uint32) for name in ("sum", "moment")}
    channels["intensity"] = rng.integers(0, 256, (7, 5), np.uint8)
    data = codec.encode(channels)
    assert len(data) == codec.length(7, 5)
    back = codec.decode(data, 7, 5)
    assert back.keys() == channels.keys()
    for channel, values in channels.items():
        np.testing.assert_array_equal(back[channel], values)


def test_a_raster_by_hand() -> None:
    channels = {"R": np.array([[1, 2]], np.uint8), "G": np.array([[3, 4]], np.uint8)}
    pixel = (("R", "u1"), ("pad", "u1"), ("G", "u2"))
    assert Raster(pixel, row_pad=1).encode(channels) == bytes.fromhex("01 00 0003 02 00 0004 00")
    assert Raster(pixel, layout="lines", order="little").encode(channels) == bytes.fromhex("0102 0000 0300 0400")
    assert Raster(pixel, layout="planar", row_pad=1).encode(channels) == bytes.fromhex("0102 00 0000 00 00030004 00")


@pytest.mark.parametrize("text", ["CODEC = undefined", "", "import no_such_module"])
def test_a_codec_that_cannot_be_run_is_refused(text, tmp_path) -> None:
    (tmp_path / "own.py").write_text(text)
    with pytest.raises(SettingsError, match=r"own\.py") as refused:
        load_codec(str(tmp_path / "own.py"))
    assert "CODEC" in refused.value.hint

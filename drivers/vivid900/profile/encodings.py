"""How a profile describes the range image and the colour image behind their headers."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.vivid900.profile.raster import PAD, Codec, Kind, Layout, Raster, load_codec
from drivers.vivid900.profile.template import Order

NOT_MEASURED = 0xFFFFFFFF
"""The fixed-point number of a sample without light."""


class _Encoding(BaseModel):
    """How an image is packed: see Raster, or a plug-in codec.

    codec: "raster", or the name of a Python file next to the profile that defines CODEC (see raster.Codec).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    codec: str = "raster"
    order: Order = "big"
    layout: Layout = "interleaved"
    row_pad: Annotated[int, Field(ge=0, le=4096)] = 0

    def codec_of(self, pixel: tuple[tuple[str, Kind], ...]) -> Codec:
        """The codec for samples of these channels."""
        if self.codec != "raster":
            return load_codec(self.codec)
        return Raster(pixel, order=self.order, layout=self.layout, row_pad=self.row_pad)


class PitchEncoding(_Encoding):
    """The range image.

    pixel          its integers in their order. `sum` Σx and `moment` Σ(i·x) over the frames i give the temporal
                   barycentre (US 6,151,118), or `frame` is the barycentre itself; `intensity` is the brightest x, and
                   `pad` means nothing.
    fraction_bits  bits of `frame` behind the binary point; FFFFFFFFh is a sample without light.
    """

    pixel: tuple[tuple[Literal["sum", "moment", "intensity", "frame", "pad"], Kind], ...] = ()
    fraction_bits: Annotated[int, Field(ge=0, le=24)] = 16

    @property
    def image(self) -> Codec:
        """The codec."""
        return self.codec_of(self.pixel)

    @property
    def fraction(self) -> int:
        """What `frame` counts in a frame."""
        return 1 << self.fraction_bits

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        names = sorted(name for name, _ in self.pixel if name not in (PAD, "intensity"))
        again = sum(name == "intensity" for name, _ in self.pixel) > 1
        if self.pixel and (again or names not in (["moment", "sum"], ["frame"])):
            raise ValueError("a pixel has sum and moment, or frame, and may have intensity, each once")
        return self


class ColourEncoding(_Encoding):
    """Packing of the colour image.

    channels: those of a pixel in their order, X for one without a meaning.
    """

    channels: Annotated[str, Field(pattern="^[RGBX]{3,8}$")] = "RGB"

    def image(self, channels: str, kind: Kind) -> Codec:
        """The codec of an image with these channels."""
        names = self.channels if channels == "RGB" else channels
        return self.codec_of(tuple((PAD if name == "X" else name, kind) for name in names))

    @model_validator(mode="after")
    def _has_three_colours(self) -> Self:
        if sorted(self.channels.replace("X", "")) != ["B", "G", "R"]:
            raise ValueError("a pixel has R, G and B, each once")
        return self

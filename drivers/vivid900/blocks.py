"""Blocks of fixed-width fields, as a profile describes them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal, Self
from zlib import crc32

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.scanner import SettingsError
from drivers.vivid900.errors import BadReply

_Model = ConfigDict(frozen=True, extra="forbid")
MAX_LENGTH = 4096  # longer than any header or parameter block can sensibly be


class Span(BaseModel):
    """An unsigned integer in a block: offset of its first byte, width in bytes, and its value when that is fixed."""

    model_config = _Model
    at: Annotated[int, Field(ge=0)]
    bytes: Annotated[int, Field(ge=1, le=8)]
    value: int | None = None

    @property
    def end(self) -> int:
        """One past its last byte."""
        return self.at + self.bytes


class Block(BaseModel):
    """A block, or the header of one.

    fields  name → span. crc32: offset of the CRC-32 of block and payload, computed with zeros at that offset; None
            when the block has no checksum.
    """

    model_config = _Model
    length: Annotated[int, Field(ge=0, le=MAX_LENGTH)]
    order: Literal["big", "little"] = "big"
    fields: dict[str, Span] = {}
    crc32: Annotated[int, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _holds_its_fields(self) -> Self:
        spans = [*self.fields.values(), *([] if self.crc32 is None else [Span(at=self.crc32, bytes=4)])]
        taken = [at for span in spans for at in range(span.at, span.end)]
        if len(set(taken)) < len(taken) or any(at >= self.length for at in taken):
            raise ValueError("fields overlap, or lie beyond the end of the block")
        if any(span.value is not None and not 0 <= span.value < 1 << 8 * span.bytes for span in spans):
            raise ValueError("a fixed value does not fit into its bytes")
        return self

    def build(self, values: Mapping[str, int], payload: bytes = b"", *, base: bytes | None = None) -> bytes:
        """The block followed by its payload. Raises SettingsError for a value that is missing or too large.

        base  block whose bytes without a field are kept; zeros by default.
        """
        block = bytearray(self.length if base is None else base)
        if len(block) != self.length:
            raise SettingsError(f"a block of {len(block)} bytes cannot be changed, it has {self.length}")
        for name, span in self.fields.items():
            value = values.get(name, span.value)
            if value is None or not 0 <= value < 1 << 8 * span.bytes:
                raise SettingsError(f"{name} = {value} does not fit into {span.bytes} bytes of the block")
            block[span.at : span.end] = value.to_bytes(span.bytes, self.order)
        if self.crc32 is not None:
            block[self.crc32 : self.crc32 + 4] = bytes(4)
            block[self.crc32 : self.crc32 + 4] = crc32(payload, crc32(block)).to_bytes(4, self.order)
        return bytes(block) + payload

    def parse(self, data: bytes, *, payload: int = 0) -> dict[str, int]:
        """The values of the fields of a block followed by `payload` bytes.

        Raises BadReply when the length, a fixed value or the checksum is wrong.
        """
        if len(data) != self.length + payload:
            raise BadReply(f"a block of {len(data)} bytes came, {self.length + payload} were to come")
        if self.crc32 is not None and _sum_without(data, self.crc32) != self._number(data, self.crc32, self.crc32 + 4):
            raise BadReply("a block was damaged on its way: its checksum is another")
        values = {name: self._number(data, span.at, span.end) for name, span in self.fields.items()}
        for name, span in self.fields.items():
            if span.value not in (None, values[name]):
                raise BadReply(f"a block of another kind came: its {name} is {values[name]:#x}, not {span.value:#x}")
        return values

    def _number(self, data: bytes, start: int, end: int) -> int:
        return int.from_bytes(data[start:end], self.order)


def _sum_without(data: bytes, at: int) -> int:
    """CRC-32 of the data with zeros in place of the checksum itself."""
    view = memoryview(data)
    return crc32(view[at + 4 :], crc32(bytes(4), crc32(view[:at])))

"""Templates: bytes with named fields.

They are used for command blocks, the data sent with them, and headers of images.

A template is a table (`length`, `fields`, `checksum`), or text such as `"C6 80|kind:2-0 offset/4 length/3< 00"`:

word           stands for
C6             this byte
length/3       a big-endian number of three bytes; `length/3<` a little-endian one
80|kind:2-0    one byte whose bits 2 to 0 are a number and whose other bits are those of 80
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from collections.abc import Callable, Mapping
from functools import lru_cache, reduce
from operator import xor
from typing import Annotated, Any, Literal, Self
from zlib import crc32

from pydantic import BaseModel, ConfigDict, Field, model_validator

from drivers.scanner import SettingsError
from drivers.scsi.errors import BadReply

_Model = ConfigDict(frozen=True, extra="forbid")
Order = Literal["big", "little"]
ChecksumKind = Literal["crc32", "crc16", "sum16", "sum8", "xor8"]
Data = bytes | bytearray  # `bytes` is a field of Span
MAX_LENGTH = 4096  # longer than any header or parameter block can sensibly be
MAX_WIDTH = 8

CHECKSUMS: Mapping[ChecksumKind, tuple[int, Callable[[bytes], int]]] = {
    "crc32": (4, crc32),
    "crc16": (2, lambda data: crc_hqx(data, 0xFFFF)),
    "sum16": (2, lambda data: sum(data) & 0xFFFF),
    "sum8": (1, lambda data: sum(data) & 0xFF),
    "xor8": (1, lambda data: reduce(xor, data, 0)),
}
"""Name → bytes that it takes, and the function. crc16 is CCITT's, begun with FFFFh."""

_BYTE = re.compile(r"[0-9A-Fa-f]{2}")
_NUMBER = re.compile(r"([a-z_]+)/([1-9])(<?)")
_BITS = re.compile(r"([0-9A-Fa-f]{2})\|([a-z_]+):([0-7])-([0-7])")


class Span(BaseModel):
    """An unsigned integer in a template.

    at, bytes      offset of its first byte, and its width; order: that of the template by default.
    low_bit, bits  its least significant bit and its width in bits, where it has not the bytes to itself.
    scale          what the number counts: 10 for tenths of the field's unit.
    value          its value when that is fixed.
    """

    model_config = _Model
    at: Annotated[int, Field(ge=0, le=MAX_LENGTH)]
    bytes: Annotated[int, Field(ge=1, le=MAX_WIDTH)] = 1
    order: Order | None = None
    low_bit: Annotated[int, Field(ge=0, lt=8 * MAX_WIDTH)] = 0
    bits: Annotated[int, Field(ge=1, le=8 * MAX_WIDTH)] | None = None
    scale: Annotated[int, Field(ge=1)] = 1
    value: int | None = None

    @property
    def end(self) -> int:
        """One past its last byte."""
        return self.at + self.bytes

    @property
    def width(self) -> int:
        """Its bits."""
        return 8 * self.bytes - self.low_bit if self.bits is None else self.bits

    @model_validator(mode="after")
    def _holds_its_bits(self) -> Self:
        if self.width < 1 or self.low_bit + self.width > 8 * self.bytes:
            raise ValueError("the bits of a field lie beyond its bytes")
        if self.value is not None and not self.holds(self.value):
            raise ValueError("a fixed value does not fit into its bytes")
        return self

    def holds(self, value: int) -> bool:
        """Whether a value fits."""
        return 0 <= value * self.scale < 1 << self.width

    def read(self, data: Data, order: Order) -> int:
        """The value in the bytes of a template of that order, rounded to the field's unit."""
        number = int.from_bytes(data[self.at : self.end], self.order or order)
        return (number >> self.low_bit & self._ones) * 2 // self.scale + 1 >> 1

    def write(self, data: bytearray, value: int, order: Order) -> None:
        """Write a value, and leave the bits around it."""
        order = self.order or order
        others = int.from_bytes(data[self.at : self.end], order) & ~(self._ones << self.low_bit)
        number = others | value * self.scale << self.low_bit
        data[self.at : self.end] = number.to_bytes(self.bytes, order)

    def mask(self, length: int, order: Order) -> int:
        """The bits that it takes, as one big-endian number of `length` bytes."""
        own = (self._ones << self.low_bit).to_bytes(self.bytes, self.order or order)
        return _number(own) << 8 * (length - self.end)

    @property
    def _ones(self) -> int:
        return (1 << self.width) - 1


class Checksum(BaseModel):
    """A checksum of template and payload, computed with zeros in its own place."""

    model_config = _Model
    kind: ChecksumKind
    at: Annotated[int, Field(ge=0, le=MAX_LENGTH)]
    order: Order | None = None

    @property
    def span(self) -> Span:
        """Where it lies."""
        return _span(self.at, CHECKSUMS[self.kind][0], self.order)

    def of(self, data: bytes) -> int:
        """The checksum that the data should have."""
        blank = bytearray(data)
        self.span.write(blank, 0, "big")
        return CHECKSUMS[self.kind][1](bytes(blank))


@lru_cache(maxsize=64)  # asked for with every block that comes or goes
def _span(at: int, width: int, order: Order | None) -> Span:
    return Span(at=at, bytes=width, order=order)


class Template(BaseModel):
    """Bytes with named fields.

    Written as text, its other bytes are constants; as a table, they are unknown: kept and not checked.
    fields: name → span.
    constants: its bytes outside the fields, in hexadecimal; None when they are unknown.
    """

    model_config = _Model
    length: Annotated[int, Field(ge=0, le=MAX_LENGTH)] = 0
    order: Order = "big"
    fields: dict[str, Span] = {}
    checksum: Checksum | None = None
    constants: bytes | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_text(cls, table: Any) -> Any:
        return _parsed(table) if isinstance(table, str) else table

    @model_validator(mode="after")
    def _holds_its_fields(self) -> Self:
        spans, taken = [*self.fields.values(), *([self.checksum.span] if self.checksum else [])], 0
        for span in spans:
            if span.end > self.length or taken & (bits := span.mask(self.length, self.order)):
                raise ValueError("fields overlap, or lie beyond the end of the block")
            taken |= bits
        return self

    @property
    def is_checked(self) -> bool:
        """Return whether the checksum is strong enough for an image.

        8 and 16 bits let too much damage pass.
        """
        return self.checksum is not None and self.checksum.kind == "crc32"

    def build(self, values: Mapping[str, int], payload: bytes = b"", *, base: bytes | None = None) -> bytes:
        """Return the bytes followed by their payload.

        base: bytes in which only the given values are changed; without it, all that is not a field is constant or zero.
        Raises SettingsError for a value that is missing or too large.
        """
        block = bytearray((self.constants or bytes(self.length)) if base is None else base)
        if len(block) != self.length:
            raise SettingsError(f"a block of {len(block)} bytes cannot be changed, it has {self.length}")
        for name, span in self.fields.items():
            value = values.get(name, span.value)
            if value is None and base is not None:
                continue
            if value is None or not span.holds(value):
                raise SettingsError(f"{name} = {value} does not fit into {span.width} bits of the block")
            span.write(block, value, self.order)
        if self.checksum is not None:
            self.checksum.span.write(block, self.checksum.of(bytes(block) + payload), self.order)
        return bytes(block) + payload

    def parse(self, data: bytes, *, payload: int = 0) -> dict[str, int]:
        """The values of the fields of bytes followed by `payload` more.

        Raises BadReply when the length, a constant, a fixed value or the checksum is wrong.
        """
        if len(data) != self.length + payload:
            raise BadReply(f"a block of {len(data)} bytes came, {self.length + payload} were to come")
        if self.checksum and self.checksum.of(data) != self.checksum.span.read(data, self.order):
            raise BadReply("a block was damaged on its way: its checksum is another")
        values = {name: span.read(data, self.order) for name, span in self.fields.items()}
        for name, span in self.fields.items():
            if span.value not in (None, values[name]):
                raise BadReply(f"a block of another kind came: its {name} is {values[name]:#x}, not {span.value:#x}")
        if self.constants is not None and (_number(data[: self.length]) ^ _number(self.constants)) & ~self._free:
            raise BadReply("a block of another kind came: its constant bytes are others")
        return values

    def match(self, data: bytes) -> dict[str, int] | None:
        """The values of the fields, None when the bytes are not of this template."""
        try:
            return self.parse(data)
        except BadReply:
            return None

    def overlaps(self, other: Template) -> bool:
        """Whether some bytes fit both templates, which are of text."""
        constant = ~(self._free | other._free)
        same = not (_number(self.constants or b"") ^ _number(other.constants or b"")) & constant
        return self.length == other.length and same

    @property
    def _free(self) -> int:
        """The bits that fields take, as one big-endian number of the template's length."""
        return reduce(lambda bits, span: bits | span.mask(self.length, self.order), self.fields.values(), 0)


def _number(data: bytes | bytearray) -> int:
    return int.from_bytes(data, "big")


def _parsed(text: str) -> dict[str, Any]:
    """Return the table of a template in the notation above.

    Raises ValueError that says which word is wrong.
    """
    constants, fields = bytearray(), dict[str, Span]()
    for word in text.split():
        at = len(constants)
        if number := _NUMBER.fullmatch(word):
            name, size, little = number.groups()
            span = Span(at=at, bytes=int(size), order="little" if little else "big")
        elif bits := _BITS.fullmatch(word):
            other, name, high, low = bits.groups()
            span = Span(at=at, low_bit=int(low), bits=int(high) - int(low) + 1)
        elif _BYTE.fullmatch(word):
            constants.append(int(word, 16))
            continue
        else:
            raise ValueError(f"{word!r} is neither a byte like C0 nor a field like length/3 or 00|kind:2-0")
        if name in fields:
            raise ValueError(f"the field {name} occurs twice")
        fields[name] = span
        constants += bytes(span.bytes) if number else bytes.fromhex(other)
    return {"length": len(constants), "fields": fields, "constants": bytes(constants)}

"""Command descriptor blocks written as text: `"C6 00 offset/4 length/3 00"`.

Two hexadecimal digits are a fixed byte; `name/n` is a big-endian number of n bytes, as in every CDB of the standard.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate

from drivers.scanner import SettingsError

LENGTHS = range(6, 17)  # six bytes are the shortest; sixteen the longest that USB bridges and SG_IO both carry
MAX_FIELD = 4
_BYTE, _FIELD = re.compile(r"[0-9A-Fa-f]{2}"), re.compile(r"([a-z_]+)/([1-9])")


@dataclass(frozen=True)
class Layout:
    """The bytes of one command.

    fixed   the constant bytes, 0 where there is a field.
    fields  name → (offset of its first byte, number of bytes).
    """

    fixed: bytes
    fields: Mapping[str, tuple[int, int]]

    @staticmethod
    def read(text: str) -> Layout:
        """Read the notation above. Raises ValueError that says which word is wrong."""
        words = text.split()
        found = [_FIELD.fullmatch(word) for word in words]
        for word, field in zip(words, found, strict=True):
            if not field and not _BYTE.fullmatch(word):
                raise ValueError(f"{word!r} is neither a byte like C0 nor a field like length/3")
        sizes = [int(field[2]) if field else 1 for field in found]
        starts = [0, *accumulate(sizes)]
        fixed = b"".join(
            bytes(size) if field else bytes.fromhex(word) for word, field, size in zip(words, found, sizes, strict=True)
        )
        names = [field[1] for field in found if field]
        if len(fixed) not in LENGTHS:
            raise ValueError(f"a CDB of {len(fixed)} bytes, {LENGTHS.start} to {LENGTHS.stop - 1} are possible")
        if (found and found[0]) or len(set(names)) < len(names) or max(sizes) > MAX_FIELD:
            raise ValueError("the first byte is fixed, every field occurs once and has at most four bytes")
        fields = {f[1]: (start, size) for f, start, size in zip(found, starts, sizes, strict=False) if f}
        return Layout(fixed, fields)

    def build(self, **values: int) -> bytes:
        """The CDB; values without a field are ignored. Raises SettingsError for a value that is too large."""
        cdb = bytearray(self.fixed)
        for name, (start, size) in self.fields.items():
            if not 0 <= values[name] < 1 << 8 * size:
                raise SettingsError(f"{name} = {values[name]} does not fit into {size} bytes of the command")
            cdb[start : start + size] = values[name].to_bytes(size, "big")
        return bytes(cdb)

    def parse(self, cdb: bytes) -> dict[str, int] | None:
        """The values of the fields, None when the bytes are not this command."""
        if len(cdb) != len(self.fixed):
            return None
        values = {name: int.from_bytes(cdb[at : at + size], "big") for name, (at, size) in self.fields.items()}
        return values if self.build(**values) == cdb else None

    def overlaps(self, other: Layout) -> bool:
        """Whether some bytes could be either command."""
        if len(self.fixed) != len(other.fixed):
            return False
        free = {at for one in (self, other) for start, size in one.fields.values() for at in range(start, start + size)}
        return all(self.fixed[at] == other.fixed[at] for at in range(len(self.fixed)) if at not in free)

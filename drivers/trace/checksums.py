"""Finds the checksum of a kind of block by trying every kind at every place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import get_args

from drivers.vivid900.profile.template import CHECKSUMS, Checksum, ChecksumKind, Order

ENOUGH_BYTES = 4  # bytes of checksum, over all blocks, that have to be right; chance is 2⁻³² to one place then
ORDERS: tuple[Order, ...] = ("big", "little")


def find_checksum(blocks: Sequence[bytes], header: int) -> Checksum | None:
    """Find the checksum of blocks in their first `header` bytes.

    Of an exclusive or the place cannot be determined, since every byte is that of all others: the last one is taken.
    Returns None when none is right in all blocks.
    """
    different = list(dict.fromkeys(blocks))
    return next((found for found in _candidates(header) if _is_right(found, different)), None)


def _candidates(header: int) -> Iterator[Checksum]:
    """The strongest kinds first, and from the end, where checksums mostly are."""
    for kind in sorted(get_args(ChecksumKind), key=lambda kind: -CHECKSUMS[kind][0]):
        width = CHECKSUMS[kind][0]
        for at in range(header - width, -1, -1):
            yield from (Checksum(kind=kind, at=at, order=order) for order in ORDERS[: 2 if width > 1 else 1])


def _is_right(checksum: Checksum, blocks: Sequence[bytes]) -> bool:
    if len(blocks) * checksum.span.bytes < ENOUGH_BYTES or any(len(block) < checksum.span.end for block in blocks):
        return False
    return all(checksum.span.read(block, "big") == checksum.of(block) for block in blocks)

"""Bytes that were right once: what cables, bridges and firmware make of them."""

from __future__ import annotations

import random


def mutated(data: bytes, rng: random.Random) -> bytes:
    """A few bytes changed, cut off, doubled, put in, or all of it noise."""
    changed = bytearray(data)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(changed) + 1)
        match rng.randrange(6):
            case 0 if at < len(changed):
                changed[at] ^= 1 << rng.randrange(8)
            case 1:
                del changed[at:]
            case 2:
                changed[at:at] = rng.randbytes(rng.randint(1, 16))
            case 3:
                changed[at : at + 4] = rng.choice((b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", bytes(4)))
            case 4:
                changed += changed[at : at + 32]
            case _ if len(changed) < 64:
                changed[:] = rng.randbytes(len(changed))
    return bytes(changed)

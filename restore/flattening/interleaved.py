"""An order of sticks in which none waits for the one before it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from restore.scan import Floats, Ints

GOLDEN = (5.0**0.5 - 1.0) / 2.0  # the golden section, whose multiples lie evenly over a list
BLOCK = 8192  # pairs of a quarter of a megabyte


def interleave(pairs: Ints, lengths: Floats) -> tuple[Ints, Floats]:
    """The same pairs (k, 2) and lengths (k,) in the order of `interleaved_order`."""
    order = interleaved_order(len(pairs))
    return pairs.take(order, axis=0), lengths.take(order)


def interleaved_order(count: int) -> Ints:
    """(count,) an order in which neighbours in the list are none on the sheet.

    Going over one pair then does not wait for the one before it, and the processor takes several at a time. Those of a
    block stay together, as it fits into the processor's cache.
    """
    whole = count // BLOCK * BLOCK
    blocks = np.arange(0, whole, BLOCK)[:, None] + _strides(BLOCK)
    return np.concatenate([blocks.ravel(), whole + _strides(count - whole)])


@lru_cache(maxsize=16)
def _strides(count: int) -> Ints:
    """0 to count − 1 in steps of about the golden section, which come back to the same place last."""
    stride = max(round(GOLDEN * count), 1)
    while np.gcd(stride, max(count, 1)) != 1:
        stride += 1
    return np.arange(count) * stride % max(count, 1)

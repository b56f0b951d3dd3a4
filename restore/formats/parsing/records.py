"""Lists of numbers, each behind its length, in the bytes of a file: PLY and VVD."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from restore.formats.parsing.mesh import Numbers
from restore.scan import Ints


@numba.njit(cache=True)
def find_lists(
    content: NDArray[np.uint8], at: int, lengths: Ints, sizes: Ints, big: bool, starts: Numbers, counts: Numbers
) -> int:
    """Fill the offset and the length of each list, (lists, records).

    A record has one number or list after the other, and the first begins at the offset `at`.
    lengths, sizes: bytes of the length of a list (0 for a number, 8 for a float64) and of its numbers, by property.
    Returns where the last ends, −1 beyond the end.
    """
    for record in range(starts.shape[1]):
        k = 0
        for p in range(len(lengths)):
            count = 1
            if lengths[p]:
                if at + lengths[p] > len(content):
                    return -1
                count = _length(content, at, lengths[p], big)
                at += lengths[p]
                counts[k, record] = min(count, 2**31 - 1)  # also of a list that the file is too short for
            if count < 0 or count > (len(content) - at) // sizes[p]:
                return -1
            if lengths[p]:
                starts[k, record] = at
                k += 1
            at += count * sizes[p]
    return at


@numba.njit(cache=True)
def _length(content: NDArray[np.uint8], at: int, width: int, big: bool) -> int:
    """Return the length of a list at an offset, −1 for one that is not a whole number.

    Signed ones are read as unsigned.
    """
    if width == 8:
        number = content[at : at + 8].view(np.float64)[0]
        return int(number) if 0 <= number < 2**31 and number == np.floor(number) else -1
    value = 0
    for k in range(width):
        value = value * 256 + int(content[at + (k if big else width - 1 - k)])
    return value


@numba.njit(cache=True)
def gather(content: NDArray[np.uint8], starts: Numbers, counts: Numbers, width: int, values: NDArray[np.uint8]) -> None:
    """Copy the numbers of lists, one behind the other, to bytes (c,).

    starts, counts: (n,), of the lists.
    width: bytes of a number.
    """
    at = 0
    for record in range(len(starts)):
        for k in range(starts[record], starts[record] + counts[record] * width):
            values[at] = content[k]
            at += 1

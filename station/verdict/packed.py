"""The bytes of a fingerprint, which is text in a record.

They are unpacked to their size and no further.
"""

from __future__ import annotations

import base64
import binascii
import zlib

PACKED_BYTES = 192 * 96  # of a fingerprint: two pixels in each


def pack(data: bytes) -> str:
    """The text of a fingerprint's PACKED_BYTES."""
    return base64.b64encode(zlib.compress(data, 9)).decode()


def unpack(fingerprint: str) -> bytes:
    """The PACKED_BYTES of a fingerprint. Raises ValueError for a text that is not one."""
    try:
        unpacking = zlib.decompressobj()
        data = unpacking.decompress(base64.b64decode(fingerprint, validate=True), PACKED_BYTES + 1)
    except (binascii.Error, zlib.error, ValueError) as error:
        raise ValueError(f"the fingerprint cannot be unpacked: {error}") from error
    if len(data) != PACKED_BYTES or not unpacking.eof:
        raise ValueError("the fingerprint is not of the size that it should be")
    return data

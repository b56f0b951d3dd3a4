"""Write PNG by bands of rows, filtered and compressed in parallel.

Of a large picture a few bands are in memory. Every row is filtered by Paeth's predictor and compressed as runs of one
byte only (Z_RLE). On restored pages the writers of Pillow, OpenCV and libpng take 1.6 to 2.2 times the processor time
for files a quarter to a third larger at their fastest, and 8 to 10 times for files as small
(`python -m bench.png_writers`). zlib-ng behind the same filter takes two thirds of the time for the same size, which
would be a twenty-fifth of a page at 600 dpi. Bands are parts of one zlib stream (RFC 1950) that end on a byte; their
number depends on the picture alone, and so does the file.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numba
import numpy as np
from PIL import Image

from restore.runtime.rows import Rows
from restore.runtime.threads import BAND_PIXELS, in_threads
from restore.scan import Bytes

SIGNATURE = b"\x89PNG\r\n\x1a\n"
PAETH = 4  # filter type (PNG specification, 9.2)
LEVEL, RAW, MEMORY = 6, -15, 9  # of zlib; negative: without header and check sum, which the stream has once
STREAM = b"\x78\x01"  # its header: a window of 32 kB, no preset dictionary
ADLER = 65521  # modulus of the check sum
AT_ONCE = 16  # bands that are compressed before any is passed on


def png_parts(picture: Bytes | Rows, **chunks: Any) -> Iterator[bytes]:
    """Encode (h, w, 3) uint8 RGB as the parts of a PNG file, in order.

    One that is drawn by rows is never in memory whole.
    chunks: what Pillow's writer of PNG takes in addition.
    """
    picture = picture if isinstance(picture, Rows) else Rows.of(picture)
    height, width = picture.shape[:2]
    before, after = _other_chunks(**chunks)
    yield SIGNATURE + _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + before
    rows = max(1, BAND_PIXELS // width)
    starts = range(0, height, rows)
    check, above = 1, np.zeros(3 * width, np.uint8)
    for first in range(0, len(starts), AT_ONCE):
        some = starts[first : first + AT_ONCE]
        drawn = np.ascontiguousarray(picture.rows(slice(some[0], min(some[-1] + rows, height)))).reshape(-1, 3 * width)
        bands = _compressed_bands(drawn, above, rows, ends=some[-1] + rows >= height)
        above = drawn[-1].copy()
        for start, (band, sum_of_band, size) in zip(some, bands, strict=True):
            check = _joined_sum(check, sum_of_band, size)
            head = STREAM if start == 0 else b""
            tail = struct.pack(">I", check) if start + rows >= height else b""
            yield _chunk(b"IDAT", head + band + tail)
    yield after + _chunk(b"IEND", b"")


def _compressed_bands(drawn: Bytes, above: Bytes, rows: int, *, ends: bool) -> list[tuple[bytes, int, int]]:
    """Compress bands of some rows, each to a part of a zlib stream.

    drawn: (h, 3 w), below a row `above`.
    Returns also the check sum of the filtered rows of each, and their size in bytes.
    ends: whether the stream ends with them.
    """

    def compressed(start: int) -> tuple[bytes, int, int]:
        own = drawn[start : start + rows]
        filtered = filtered_rows(own, drawn[start - 1] if start else above)
        packer = zlib.compressobj(LEVEL, zlib.DEFLATED, RAW, MEMORY, zlib.Z_RLE)
        packed = packer.compress(filtered.data)
        last = ends and start + rows >= len(drawn)
        packed += packer.flush(zlib.Z_FINISH if last else zlib.Z_SYNC_FLUSH)
        return packed, zlib.adler32(filtered.data), filtered.size

    return in_threads(compressed, range(0, len(drawn), rows))


def filtered_rows(rows: Bytes, above: Bytes) -> Bytes:
    """Return rows (h, 3 w), below a row `above` (3 w,), as PNG compresses them: (h, 3 w + 1)."""
    filtered = np.empty((len(rows), rows.shape[1] + 1), np.uint8)
    _filter(rows, above, filtered)
    return filtered


@numba.njit(cache=True, nogil=True)
def _filter(rows: Bytes, above: Bytes, out: Bytes) -> None:
    """Write rows less Paeth's prediction of each byte.

    rows: (h, 3 w), below a row `above`.
    out: (h, 3 w + 1), its first column the type of the filter.
    """
    for row in range(len(rows)):
        out[row, 0] = PAETH
        here, over = rows[row], above if row == 0 else rows[row - 1]
        for col in range(len(here)):
            up = np.int32(over[col])
            left = np.int32(here[col - 3]) if col > 2 else np.int32(0)
            corner = np.int32(over[col - 3]) if col > 2 else np.int32(0)
            from_left, from_up, from_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
            nearest = up if from_up <= from_corner else corner
            if from_left <= from_up and from_left <= from_corner:
                nearest = left
            out[row, col + 1] = here[col] - np.uint8(nearest)


def _joined_sum(first: int, second: int, size: int) -> int:
    """Return the Adler-32 check sum of two parts, from theirs.

    size: of the second in bytes.
    """
    low = (first & 0xFFFF) + (second & 0xFFFF) - 1
    high = (first >> 16) + (second >> 16) + size * ((first & 0xFFFF) - 1)
    return (high % ADLER) << 16 | low % ADLER


def _other_chunks(**chunks: Any) -> tuple[bytes, bytes]:
    """Return the chunks before and behind the pixels, as Pillow writes them."""
    out = io.BytesIO()
    Image.new("RGB", (1, 1)).save(out, "PNG", **chunks)
    file, place = out.getvalue(), len(SIGNATURE)
    before, after = bytearray(), bytearray()
    beyond = False
    while place < len(file):
        (length,) = struct.unpack_from(">I", file, place)
        kind, end = file[place + 4 : place + 8], place + length + 12
        beyond |= kind == b"IDAT"
        if kind not in (b"IHDR", b"IDAT", b"IEND"):
            (after if beyond else before).extend(file[place:end])
        place = end
    return bytes(before), bytes(after)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

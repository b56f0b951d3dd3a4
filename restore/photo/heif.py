"""HEIC pictures, as phones write them, opened as Pillow's pictures (extra `photos`)."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from restore.errors import LibraryMissing

if TYPE_CHECKING:
    from PIL import Image

FILE_BOX = b"ftyp"  # at byte 4 of every file of the ISO base media format (ISO/IEC 14496-12, 4.3)
BRANDS = (b"heic", b"heix", b"heim", b"heis", b"mif1", b"msf1")  # ISO/IEC 23008-12


def is_heif(head: bytes) -> bool:
    """Return whether a file holds a still picture in ISO base media format.

    head: its first twelve bytes.
    """
    return head[4:8] == FILE_BOX and head[8:12] in BRANDS


class HeifPicture:
    """The main picture of a HEIC file, not yet decoded: its size (w, h), already upright."""

    def __init__(self, data: bytes) -> None:
        """Raises LibraryMissing without pi-heif, and pi-heif's errors for damaged data."""
        try:
            import pi_heif
        except ImportError as error:
            raise LibraryMissing("HEIC images need pi-heif", "pip install 'planish[photos]'") from error
        self._file: Any = pi_heif.open_heif(io.BytesIO(data))
        self.size: tuple[int, int] = self._file.size

    def decoded(self) -> tuple[Image.Image, int | None]:
        """The picture, its EXIF without orientation, and the orientation tag that was in it.

        The container's own turn has been applied. The tag only repeats it: nothing is left to turn.
        """
        picture: Image.Image = self._file.to_pillow()
        return picture, picture.info.get("original_orientation")

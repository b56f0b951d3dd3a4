"""Read photographs as cameras, phones and scanning programs write them."""

from __future__ import annotations

import io
import stat
import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import ExifTags, Image, ImageCms, ImageOps, UnidentifiedImageError

from restore.errors import BadInput
from restore.files import read_regular
from restore.photo.camera import PhotoCamera
from restore.scan import Bytes

# 240 megapixels are 0.7 GB; medium-format backs have 150.
MAX_PIXELS = 160_000_000
MAX_BYTES = 2**30  # 160 megapixels without compression, 16 bits a channel
MIN_SIDE = 64  # pixels: a thumbnail
KINDS = (
    "JPEG",
    "PNG",
    "TIFF",
    "PPM",
    "BMP",
)  # JPEG includes the phones' files of several pictures (MPO): the first counts
FILM_DIAGONAL_MM = 43.27  # 36 × 24 mm, to which FocalLengthIn35mmFilm refers (CIPA DC-008, tag 0xA405)
HEIF_BOX = b"ftyp"  # at byte 4 of every file of the ISO base media format (ISO/IEC 14496-12, 4.3)
SIXTEEN_BIT = 257.0  # 65535 / 255
SRGB = ImageCms.createProfile("sRGB")


@dataclass(frozen=True, eq=False)
class Photograph:
    """A photograph of the page.

    image     (h, w, 3) uint8 RGB (sRGB), upright as its camera meant it.
    name      what to call it.
    focal_px  its focal length in pixels, None when the file does not tell.
    camera    that took it, in the frame of the scan, where it is known.
    """

    image: Bytes
    name: str = "photograph"
    focal_px: float | None = None
    camera: PhotoCamera | None = None


def read_photograph(path: Path | str) -> Photograph:
    """Read a photograph: turned as EXIF says, its colours brought to sRGB.

    Raises BadInput when the file is missing, damaged, cut short, too large or no picture.
    """
    path = Path(path)
    _check(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            with Image.open(io.BytesIO(read_regular(path, MAX_BYTES)), formats=KINDS) as picture:
                _check_size(picture.size, path)
                focal = _focal_px(picture)
                return Photograph(_srgb(ImageOps.exif_transpose(picture)), path.name, focal)
        except BadInput:
            raise
        except UnidentifiedImageError as error:
            raise _unknown(path) from error
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            fault = "seems cut short" if "truncated" in str(error).lower() else f"cannot be read: {error}"
            raise BadInput(f"{path} {fault}", "the file is damaged: copy it again") from error


def _unknown(path: Path) -> BadInput:
    """What to say of a file that is no picture of the KINDS."""
    head = read_regular(path, MAX_BYTES)[:8]
    if head[4:] == HEIF_BOX:
        return BadInput(
            f"{path} is a HEIC or AVIF picture, which is not read", "save it as JPEG (phones can be set to)"
        )
    return BadInput(f"{path} is no picture of a known kind", f"use one of {', '.join(KINDS)}")


def _check(path: Path) -> None:
    try:
        state = path.stat()
    except FileNotFoundError as error:
        raise BadInput(f"{path} is not there", "check the name and the folder") from error
    except (OSError, ValueError) as error:
        raise BadInput(f"{path} cannot be read: {error}", "check the name and the folder") from error
    if stat.S_ISDIR(state.st_mode):
        raise BadInput(f"{path} is a folder", "give the photograph itself, and --photo again for each other one")
    if not stat.S_ISREG(state.st_mode):  # a pipe would block, a device never end
        raise BadInput(f"{path} is no regular file", "give the photograph itself")
    if not state.st_size:
        raise BadInput(f"{path} is empty", "copy it again: it was cut off before its first byte")


def _check_size(size: tuple[int, int], path: Path) -> None:
    if size[0] * size[1] > MAX_PIXELS:
        raise BadInput(f"{path} has too many pixels: {size[0]} × {size[1]}", "scale it down")
    if min(size) < MIN_SIDE:
        raise BadInput(f"{path} is too small: {size[0]} × {size[1]} pixels", "give the photograph, not its thumbnail")


def _srgb(picture: Image.Image) -> Bytes:
    """(h, w, 3) uint8 of a picture of any mode, through its colour profile when it has one."""
    if picture.mode == "F":
        raise BadInput("its pixels are fractions, whose white is not known", "save it with 8 or 16 bits")
    if picture.mode.startswith("I"):  # 16 bits of grey
        grey = np.clip(np.asarray(picture) / SIXTEEN_BIT + 0.5, 0, 255).astype(np.uint8)
        return np.repeat(grey[..., None], 3, axis=2)
    profile = picture.info.get("icc_profile")
    if profile:
        # A profile that is damaged or for another kind of picture says nothing: the picture is taken as sRGB.
        with suppress(ImageCms.PyCMSError, OSError):
            source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
            return np.asarray(ImageCms.profileToProfile(picture, source, SRGB, outputMode="RGB"), dtype=np.uint8)
    return np.asarray(picture.convert("RGB"), dtype=np.uint8)


def _focal_px(picture: Image.Image) -> float | None:
    """The focal length that EXIF tells, in pixels of the whole picture."""
    try:
        film_mm = float(picture.getexif().get_ifd(ExifTags.IFD.Exif).get(ExifTags.Base.FocalLengthIn35mmFilm, 0))
    except (TypeError, ValueError, ZeroDivisionError, OSError):
        return None
    return film_mm * float(np.hypot(*picture.size)) / FILM_DIAGONAL_MM if film_mm > 0 else None

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

from restore.camera.photo_camera import PhotoCamera
from restore.errors import BadInput, LibraryMissing
from restore.files import read_regular
from restore.photo.heif import FILE_BOX, HeifPicture, is_heif
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
SIXTEEN_BIT = 257.0  # 65535 / 255
HEAD = 12  # bytes by which a HEIC file is known
UPRIGHT = 1  # value of the orientation tag of a picture that needs no turn
SRGB = ImageCms.createProfile("sRGB")


@dataclass(frozen=True, eq=False)
class Photograph:
    """Photograph of the page.

    image: (h, w, 3) uint8 RGB (sRGB), upright as its camera meant it.
    name: what to call it.
    focal_px: its focal length in pixels, None when the file does not say.
    camera: that took it, in the frame of the scan, where it is known.
    orientation: EXIF tag by which the sensor's image was rotated to be upright, 1 to 8.

    >>> Photograph(np.zeros((90, 120, 3), np.uint8), "IMG_1.jpg").focal_px is None
    True
    """

    image: Bytes
    name: str = "photograph"
    focal_px: float | None = None
    camera: PhotoCamera | None = None
    orientation: int = UPRIGHT


def read_photograph(path: Path) -> Photograph:
    """Read a photograph: turned as EXIF says, its colours brought to sRGB.

    Raises BadInput when the file is missing, damaged, cut short, too large or no picture, LibraryMissing for a HEIC
    picture without pi-heif.
    """
    _check(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            data = read_regular(path, MAX_BYTES)
            return _read_heif(data, path) if is_heif(data[:HEAD]) else _read_pillow(data, path)
        except (BadInput, LibraryMissing):
            raise
        except UnidentifiedImageError as error:
            raise _unknown(path) from error
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            fault = "seems cut short" if "truncated" in str(error).lower() else f"cannot be read: {error}"
            raise BadInput(f"{path} {fault}", "the file is damaged: copy it again") from error


def _read_pillow(data: bytes, path: Path) -> Photograph:
    with Image.open(io.BytesIO(data), formats=KINDS) as picture:
        _check_size(picture.size, path)
        focal, tag = _focal_px(picture), picture.getexif().get(ExifTags.Base.Orientation)
        return Photograph(_srgb(ImageOps.exif_transpose(picture)), path.name, focal, orientation=_orientation(tag))


def _read_heif(data: bytes, path: Path) -> Photograph:
    heif = HeifPicture(data)
    _check_size(heif.size, path)
    picture, tag = heif.decoded()
    return Photograph(_srgb(picture), path.name, _focal_px(picture), orientation=_orientation(tag))


def _orientation(tag: object) -> int:
    return tag if isinstance(tag, int) and tag in range(1, 9) else UPRIGHT


def _unknown(path: Path) -> BadInput:
    if read_regular(path, MAX_BYTES)[4:8] == FILE_BOX:
        return BadInput(
            f"{path} is an AVIF image or a video, which is not read here", "save it as JPEG (phones can be set to)"
        )
    return BadInput(f"{path} is not an image of a known kind", f"use one of {', '.join(KINDS)} or HEIC")


def _check(path: Path) -> None:
    try:
        state = path.stat()
    except FileNotFoundError as error:
        raise BadInput(f"{path} is not there", "check the name and the folder") from error
    except (OSError, ValueError) as error:
        raise BadInput(f"{path} cannot be read: {error}", "check the name and the folder") from error
    if stat.S_ISDIR(state.st_mode):
        raise BadInput(f"{path} is a folder", "give each photograph by its own name")
    if not stat.S_ISREG(state.st_mode):  # a pipe would block, a device never end
        raise BadInput(f"{path} is not a regular file", "give the photograph itself")
    if not state.st_size:
        raise BadInput(f"{path} is empty", "copy it again: it was cut off before its first byte")


def _check_size(size: tuple[int, int], path: Path) -> None:
    if size[0] * size[1] > MAX_PIXELS:
        raise BadInput(f"{path} has too many pixels: {size[0]} × {size[1]}", "scale it down")
    if min(size) < MIN_SIDE:
        raise BadInput(f"{path} is too small: {size[0]} × {size[1]} pixels", "give the photograph, not its thumbnail")


def _srgb(picture: Image.Image) -> Bytes:
    """Convert a picture of any mode to sRGB, by its profile if it has one.

    Returns (h, w, 3) uint8.
    """
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
    try:
        film_mm = float(picture.getexif().get_ifd(ExifTags.IFD.Exif).get(ExifTags.Base.FocalLengthIn35mmFilm, 0))
    except (TypeError, ValueError, ZeroDivisionError, OSError):
        return None
    return film_mm * float(np.hypot(*picture.size)) / FILM_DIAGONAL_MM if film_mm > 0 else None

"""`tifxyz` folders: segments of CT volumes, in voxels.

Volume Cartographer keeps them so.

x.tif, y.tif, z.tif  one coordinate each, pictures of one channel and of one size: a pixel for each point of the grid.
meta.json            format "tifxyz"; area_vx2 and area_cm2, where both are there, give the size of a voxel.
mask.tif             optional, of the same size or an integer multiple: a point below 255 anywhere is invalid.
A point with z ≤ 0 is invalid, mostly written as (−1, −1, −1).
"""

from __future__ import annotations

import io
import json
import math
import warnings
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, ValidationError

from restore.errors import BadInput
from restore.formats.parsing.picture import MAX_PIXELS
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, is_file, read_bytes
from restore.formats.segment import MAX_SEGMENT_POINTS, SMALLER, check_segment, segment_mesh
from restore.mesh.ordered_grid import GridMesh
from restore.scan import Bytes, Floats, Mask

META, MASK, AXES = "meta.json", "mask.tif", ("x.tif", "y.tif", "z.tif")
FORMAT = "tifxyz"
MAX_META_BYTES = 2**20  # a page of settings; some list the neighbouring segments
NUMBER_MODES = ("F", "I", "I;16", "I;16B", "L")  # Pillow's names: single precision, 32, 16 and 8 bits
VALID = 255
UM_PER_CM = 1e4


class Meta(BaseModel):
    """Fields of meta.json that are read.

    The areas in voxels and in cm² that the segment had when it was made.
    """

    format: str = FORMAT
    area_vx2: float | None = None
    area_cm2: float | None = None

    @property
    def voxel_um(self) -> float | None:
        """Return the edge of a voxel, None where the areas do not give it."""
        if not (self.area_vx2 and self.area_cm2 and self.area_vx2 > 0 and self.area_cm2 > 0):
            return None
        edge = UM_PER_CM * math.sqrt(self.area_cm2) / math.sqrt(self.area_vx2)
        return edge if math.isfinite(edge) and edge > 0 else None


def is_tifxyz(folder: Path) -> bool:
    """Whether a folder holds a segment of this format."""
    return is_file(folder / META) and is_file(folder / AXES[0])


def read_tifxyz(folder: Path, texture: Bytes | None = None) -> GridMesh:
    """Read a segment, in voxels.

    texture: (h, w, 3), a picture of the whole grid.
    Raises BadInput.
    """
    meta = _meta(folder / META)
    axes = [_numbers(folder / name) for name in AXES]
    if len({axis.shape for axis in axes}) > 1:
        sizes = ", ".join(f"{axis.shape[1]} × {axis.shape[0]}" for axis in axes)
        raise BadInput(f"{folder}: its coordinates are images of different sizes: {sizes}", DAMAGED)
    valid = axes[2] > 0.0
    if is_file(folder / MASK):
        valid &= _kept(folder / MASK, valid.shape)
    return segment_mesh(folder, np.stack(axes, axis=-1), valid, texture, meta.voxel_um)


def _meta(path: Path) -> Meta:
    data = read_bytes(path, MAX_META_BYTES)
    try:
        found = Meta.model_validate(json.loads(data.decode("utf-8-sig")))
    except (ValidationError, ValueError, RecursionError) as error:
        raise BadInput(f"{path} cannot be read: {str(error).splitlines()[0]}", DAMAGED) from error
    if found.format != FORMAT:
        raise BadInput(f"{path} is of the format {found.format[:40]!r}", f"give a folder of the format {FORMAT}")
    return found


def _numbers(path: Path) -> Floats:
    """Return the numbers (rows, cols) of a picture of one channel."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            with Image.open(io.BytesIO(read_bytes(path)), formats=("TIFF",)) as picture:
                check_segment(path, picture.height, picture.width)
                if picture.mode not in NUMBER_MODES:
                    raise BadInput(f"{path} has pixels of the kind {picture.mode}", "export it in single precision")
                return np.asarray(picture, np.float64)
        except BadInput:
            raise
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            raise _unreadable(path, error) from error


def _kept(path: Path, shape: tuple[int, ...]) -> Mask:
    """Return the points (rows, cols) that a mask keeps.

    All its pixels over a point are VALID; everywhere True for a mask of another grid.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            with Image.open(io.BytesIO(read_bytes(path)), formats=("TIFF",)) as picture:
                (down, row), (right, col) = divmod(picture.height, shape[0]), divmod(picture.width, shape[1])
                if picture.width * picture.height > min(MAX_PIXELS, down * right * MAX_SEGMENT_POINTS):
                    raise BadInput(f"{path} has too many pixels: {picture.width} × {picture.height}", SMALLER)
                if row or col or not down or not right:
                    return np.ones(shape, bool)
                channel = np.asarray(picture.getchannel(0) if len(picture.getbands()) > 1 else picture)
        except BadInput:
            raise
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            raise _unreadable(path, error) from error
    valid = (channel >= VALID) if channel.dtype != bool else channel
    return np.asarray(valid.reshape(shape[0], down, shape[1], right).all(axis=(1, 3)))


def _unreadable(path: Path, error: Exception) -> BadInput:
    if "truncated" in str(error).lower():
        return BadInput(f"{path} seems cut short: it does not hold all its pixels", CUT_SHORT)
    if isinstance(error, UnidentifiedImageError):  # its text is the address of an object
        return BadInput(f"{path} is not a TIFF, or has pixels of double precision", "export it in single precision")
    return BadInput(f"{path} is not a readable image: {error}", DAMAGED)

"""`.npy` and `.npz`: arrays (rows, cols, 3) of points, as Python programs keep them.

numpy.org, "numpy.lib.format": a header in the syntax of Python, then the numbers. Pickled objects are never read. In an
archive the points are `xyz` or `points`, or `x`, `y` and `z`; the colours `rgba`, `rgb` or `colors`. An array (n, 3) is
a loose cloud; further columns are the colours. An array of records with fields x, y, z is read, too.
"""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from restore.errors import BadInput
from restore.formats.clouds.cloud import MAX_BYTES, MAX_RATIO, Cloud, Size, check_count, cloud_of
from restore.formats.clouds.grid_size import sized
from restore.formats.folder import MAX_ARRAY_HEADER
from restore.formats.parsing.picture import SMALL_PIXELS
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, read_bytes
from restore.range_image.organise import MIN_LINES

POINTS = ("xyz", "points", "point_cloud", "pointcloud", "vertices", "data")
COLOURS = ("rgba", "rgb", "colors", "colours", "color", "colour", "texture")
INTENSITIES = ("intensity", "grey", "gray")
SHAPES = "save the points as an array (rows, cols, 3) of numbers, the colours as (rows, cols, 3) of uint8"


def read_arrays(path: Path, size: Size | None = None) -> Cloud:
    """Read a cloud of an array or an archive of arrays.

    size: of its grid, where it was given.
    Raises BadInput.
    """
    data = read_bytes(path, MAX_BYTES)
    arrays = _archive(path, data) if path.suffix.lower() == ".npz" else {"points": _array(path, io.BytesIO(data))}
    points = next((arrays[name] for name in POINTS if name in arrays), None)
    axes = [arrays[name] for name in "xyz" if name in arrays]
    if points is None and len(axes) == 3 and len({axis.shape for axis in axes}) == 1:
        points = np.stack(axes, axis=-1)
    if points is None and len(arrays) == 1:
        points = next(iter(arrays.values()))
    if points is None:
        raise BadInput(f"{path} has no array of points among {', '.join(sorted(arrays))[:80]}", f"name it {POINTS[0]}")
    if points.dtype.names:
        arrays |= {name: points[name] for name in points.dtype.names}
        if not all(name in arrays for name in "xyz"):
            raise BadInput(f"{path}: its records have no fields x, y and z", SHAPES)
        points = np.stack([arrays[name] for name in "xyz"], axis=-1)
    if points.dtype.kind not in "fiu" or points.ndim not in (2, 3) or not 3 <= points.shape[-1] <= 7:
        raise BadInput(f"{path}: its points are an array {points.shape} of {points.dtype}", SHAPES)
    return _cloud(path, points, arrays, size)


def _cloud(path: Path, points: NDArray[Any], arrays: dict[str, NDArray[Any]], size: Size | None) -> Cloud:
    grid = points.shape[:-1]
    colours = next((arrays[name] for name in COLOURS if name in arrays), None)
    if colours is not None and (colours.shape[:-1] != grid or colours.shape[-1] not in (3, 4)):
        raise BadInput(f"{path}: colours {colours.shape} do not fit points {points.shape}", SHAPES)
    if colours is None and points.shape[-1] >= 6:
        colours = points[..., 3:6]
    intensity = next((arrays[name] for name in INTENSITIES if name in arrays and arrays[name].shape == grid), None)
    if colours is not None:
        _check_numbers(path, colours)
        colours = colours.reshape(-1, colours.shape[-1])[:, :3]
    cloud = cloud_of(path, points[..., :3].reshape(-1, 3), colours, None if intensity is None else intensity.ravel())
    stated = (grid[1], grid[0]) if len(grid) == 2 and min(grid) >= MIN_LINES else None
    return sized(path, cloud, size, stated)


def _check_numbers(path: Path, colours: NDArray[Any]) -> None:
    if colours.dtype.kind not in "fiu":
        raise BadInput(f"{path}: its colours are of the type {colours.dtype}", SHAPES)


def _archive(path: Path, data: bytes) -> dict[str, NDArray[Any]]:
    found: dict[str, NDArray[Any]] = {}
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as members:
            names = [name for name in members.namelist() if name.endswith(".npy")]
            for name in names:
                key = name.removesuffix(".npy").lower()
                if key in {*POINTS, *COLOURS, *INTENSITIES, *"xyz"} or len(names) == 1:
                    limit = max(SMALL_PIXELS, MAX_RATIO * members.getinfo(name).compress_size)
                    with members.open(name) as file:
                        found[key] = _array(path, file, limit)
    except BadInput:
        raise
    except Exception as error:  # zipfile and zlib raise whatever they trip over
        raise BadInput(f"{path} is not a whole archive of arrays: {error}", DAMAGED) from error
    return found


def _array(path: Path, file: BinaryIO | Any, limit: int = MAX_BYTES) -> NDArray[Any]:
    """Read one array, never more bytes than its own header and a limit allow."""
    try:
        major, _ = np.lib.format.read_magic(file)
        if major not in (1, 2):
            raise ValueError(f"version {major} of the array format")
        read = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read(file, max_header_size=MAX_ARRAY_HEADER)
        if dtype.hasobject:
            raise ValueError("it holds objects of Python, which are never read")
        if not 1 <= len(shape) <= 3 or min(shape) < 1 or not dtype.itemsize:
            raise ValueError(f"it has the shape {shape} and items of {dtype}")
        count = math.prod(shape)
        check_count(path, count // shape[-1] if len(shape) > 1 else count)
        size = count * dtype.itemsize
        if size > limit:
            raise ValueError(f"it would take {size} bytes")
        body = file.read(size)
    except BadInput:
        raise
    except Exception as error:  # the parser of headers and zlib raise whatever they trip over
        raise BadInput(f"{path}: an array cannot be read: {error}", DAMAGED) from error
    if len(body) < size:
        raise BadInput(f"{path} seems cut short: an array of {size} bytes ends after {len(body)}", CUT_SHORT)
    return np.frombuffer(body, dtype).reshape(shape, order="F" if fortran else "C")

"""Planish's own scan folder: lossless storage of a range scan.

points.npz    points (rows, cols, 3) and texture_xy (rows, cols, 2), float64 as in RangeScan
texture.png   the colour image, when there is one
scan.json     version of the format, provenance, SHA-256 of the other files; written last
"""

from __future__ import annotations

import hashlib
import io
import json
import math
import zipfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, Field, ValidationError, field_validator

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.parsing.grid import check_grid
from restore.formats.parsing.picture import check_size, decode_picture, encode_png
from restore.formats.parsing.source import DAMAGED, MAX_SAMPLES, is_file, read_bytes
from restore.numerics.units import MAX_COORDINATE_MM
from restore.runtime.arguments import checks_types
from restore.runtime.threads import in_threads
from restore.scan import Bytes, Floats, RangeScan
from restore.scan_check import KnownProvenance, check_provenance

VERSION = 1
INDEX, POINTS, TEXTURE = "scan.json", "points.npz", "texture.png"
MAX_INDEX_BYTES = 2**20  # provenance is a page of settings, never a megabyte
COMPRESSION = 1  # of zlib: half the time of its default for a file that is a hundredth larger
MAX_ARRAY_HEADER = 1024  # NumPy pads the header of a plain array to 128 bytes
ARRAYS = "give arrays as RangeScan describes them, in millimetres, NaN where nothing was measured"


class Index(BaseModel):
    """The contents of scan.json."""

    format: Literal["planish scan"] = "planish scan"
    version: int = Field(default=VERSION, ge=1, le=VERSION)
    files: dict[str, str]
    provenance: dict[str, Any] = {}
    findings: list[dict[str, Any]] = []

    @field_validator("provenance")
    @classmethod
    def _is_usable(cls, provenance: dict[str, Any]) -> dict[str, Any]:
        KnownProvenance.model_validate(provenance)
        return provenance

    @field_validator("findings")
    @classmethod
    def _are_findings(cls, findings: list[dict[str, Any]]) -> list[dict[str, Any]]:
        for one in findings:
            Finding.from_json(one)
        return findings


@checks_types
def save_scan(scan: RangeScan, folder: Path | str, *, overwrite: bool = False) -> None:
    """Write a scan folder; `load_scan` returns an identical scan.

    Raises BadInput when the folder holds a scan already (without `overwrite`), the arrays are not those of a range scan
    that can be read back, or the provenance is not valid JSON, and OSError when the disk refuses.

    >>> from tempfile import TemporaryDirectory
    >>> scan = RangeScan(np.full((2, 3, 3), -900.0), None, np.zeros((2, 3, 2)), {"device": "mine"})
    >>> with TemporaryDirectory() as folder:
    ...     save_scan(scan, Path(folder) / "page.scan")
    ...     stored = load_scan(Path(folder) / "page.scan")
    >>> stored.points.shape, stored.provenance["device"]
    ((2, 3, 3), 'mine')
    """
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise BadInput(f"{folder} is a file", "give another folder")
    if (folder / INDEX).exists() and not overwrite:
        raise BadInput(f"{folder} holds a scan already", "give another folder, or say that it may be overwritten")
    _check_arrays(scan)
    check_provenance(scan.provenance)
    encoders = {POINTS: partial(_npz, {"points": scan.points, "texture_xy": scan.texture_xy})}
    if scan.texture is not None:
        encoders[TEXTURE] = partial(encode_png, scan.texture)
    files = dict(zip(encoders, in_threads(lambda encode: encode(), encoders.values()), strict=True))
    if scan.texture is not None:
        check_size(scan.texture.shape[1], scan.texture.shape[0], len(files[TEXTURE]), "the scan's colour image")
    digests = {name: _sha256(data) for name, data in files.items()}
    try:
        found = [one.as_json() for one in scan.findings]
        index = Index(files=digests, provenance=dict(scan.provenance), findings=found)
        files[INDEX] = (json.dumps(index.model_dump(), indent=1, allow_nan=False) + "\n").encode()
    except (TypeError, ValueError, RecursionError) as error:
        raise BadInput(f"the scan's provenance is not plain JSON: {error}", "keep numbers, texts and lists") from error
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files.items():  # the index comes last: a scan that is cut short has none, or one that disagrees
        _write_atomically(folder / name, data)
    if TEXTURE not in files:
        (folder / TEXTURE).unlink(missing_ok=True)


def _check_arrays(scan: RangeScan) -> None:
    """Raise BadInput for arrays of shapes, types or values that RangeScan does not allow."""
    points, places, picture = scan.points, scan.texture_xy, scan.texture
    arrays = (points, places) if picture is None else (points, places, picture)
    if not all(isinstance(array, np.ndarray) for array in arrays):
        raise BadInput("the scan's points, texture_xy or texture are not arrays", ARRAYS)
    if points.ndim != 3 or places.ndim != 3 or (points.shape[2], places.shape[2]) != (3, 2):
        raise BadInput(f"points {points.shape} and texture_xy {places.shape} are not a range grid", ARRAYS)
    if points.dtype.kind != "f" or places.dtype.kind != "f":
        raise BadInput(f"points of {points.dtype} and texture_xy of {places.dtype} are not of floats", ARRAYS)
    check_grid(Path(POINTS), *points.shape[:2])
    _check_positions(Path(POINTS), points, places, ARRAYS)
    if picture is not None and (picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3):
        raise BadInput(f"a colour image {picture.shape} of {picture.dtype} is not (h, w, 3) of uint8", ARRAYS)
    if picture is not None and picture.size == 0:
        raise BadInput(f"a colour image {picture.shape} has no pixels", ARRAYS)


def _npz(arrays: Mapping[str, Floats]) -> bytes:
    """An .npz file of float64 arrays, the same bytes for the same arrays."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, array in arrays.items():
            data = io.BytesIO()
            np.lib.format.write_array(data, np.ascontiguousarray(array, np.float64))
            entry = zipfile.ZipInfo(f"{name}.npy")  # of 1980, whenever it is written
            archive.writestr(entry, data.getbuffer(), zipfile.ZIP_DEFLATED, COMPRESSION)
    return out.getvalue()


def read_folder(folder: Path) -> RangeScan:
    """Read a scan folder.

    Raises BadInput when a file is missing, damaged or not the one that was saved.
    """
    index = _index(folder)
    if POINTS not in index.files or not set(index.files) <= {POINTS, TEXTURE}:
        raise BadInput(f"{folder / INDEX} lists the files {sorted(index.files)}", DAMAGED)
    files = {name: _read_verified(folder / name, sha256) for name, sha256 in index.files.items()}
    texture = decode_picture(files[TEXTURE], str(folder / TEXTURE)) if TEXTURE in files else None
    return _scan(folder / POINTS, files[POINTS], texture, index)


def _index(folder: Path) -> Index:
    if not is_file(folder / INDEX):
        raise BadInput(f"{folder} is not a scan folder: it has no {INDEX}", "give a scan file or a saved scan")
    try:
        return Index.model_validate_json(read_bytes(folder / INDEX, MAX_INDEX_BYTES))
    except ValidationError as error:
        fault = error.errors()[0]
        where = ".".join(map(str, fault["loc"])) or "its text"
        raise BadInput(f"{folder / INDEX}: {where}: {fault['msg']}", DAMAGED) from error


def _read_verified(path: Path, sha256: str) -> bytes:
    data = read_bytes(path)
    if _sha256(data) != sha256:
        raise BadInput(f"{path} is not the file that was saved: its SHA-256 differs", "copy the folder again")
    return data


def _scan(path: Path, data: bytes, texture: Bytes | None, index: Index) -> RangeScan:
    points, texture_xy = _array(path, data, "points", 3), _array(path, data, "texture_xy", 2)
    check_grid(path, *points.shape[:2])
    _check_positions(path, points, texture_xy, DAMAGED)
    provenance, findings = index.provenance, tuple(map(Finding.from_json, index.findings))
    return RangeScan(points, texture, texture_xy, provenance, findings=findings)


def _check_positions(path: Path, points: Floats, texture_xy: Floats, hint: str) -> None:
    """Raise BadInput for a grid of positions that no scan has.

    Where nothing was measured, texture_xy may be NaN, and so may points alone.
    points: (rows, cols, 3) mm.
    texture_xy: (rows, cols, 2).
    """
    if points.shape[:2] != texture_xy.shape[:2]:
        raise BadInput(f"{path}: points and texture_xy are of different grids", hint)
    known = np.isfinite(texture_xy) | (np.isnan(texture_xy) & np.isnan(points).any(axis=2, keepdims=True))
    if (np.abs(points) > MAX_COORDINATE_MM).any() or not known.all():
        raise BadInput(f"{path} holds positions that cannot be", hint)


def _array(path: Path, archive: bytes, name: str, width: int) -> Floats:
    """Read one float64 array (rows, cols, width) of an .npz.

    Never more than its own header and the limits allow.
    """
    limit = MAX_ARRAY_HEADER + MAX_SAMPLES * width * 8
    try:
        with zipfile.ZipFile(io.BytesIO(archive)) as members, members.open(name + ".npy") as file:
            member = io.BytesIO(file.read(limit + 1))
        version = np.lib.format.read_magic(member)
        if version != (1, 0):
            raise ValueError(f"version {version} of the array format")
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(member, max_header_size=MAX_ARRAY_HEADER)
        body = member.read()
    except Exception as error:  # zipfile, zlib and the parser of array headers raise whatever they trip over
        raise BadInput(f"{path}: its array {name} cannot be read: {error}", DAMAGED) from error
    proper = len(shape) == 3 and min(shape) >= 0 and shape[2] == width  # the product of two negative sides is positive
    if fortran or dtype != np.float64 or not proper or len(body) != 8 * math.prod(shape):
        raise BadInput(f"{path}: {name} is not a whole array of float64 (rows, cols, {width})", DAMAGED)
    return np.frombuffer(body, np.float64).reshape(shape).copy()


def _write_atomically(path: Path, data: bytes) -> None:
    part = path.with_name(path.name + ".part")
    part.write_bytes(data)
    part.replace(path)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()

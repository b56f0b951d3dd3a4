"""Folders of a depth image with its intrinsics, as depth cameras and renderers write them.

depth*.png | .tif | .tiff   16-bit whole numbers or single precision, 0 or NaN where nothing was measured
*intrinsic* | *camera*      .json, .yaml or .txt, as `restore.formats.clouds.intrinsics` reads them
color* | rgb* | image*      the colour image, registered to the depth image or with its own camera in the intrinsics

Whole numbers are millimetres where the intrinsics do not state their step, as of Azure Kinect, Orbbec and most modes of
RealSense; fractions are metres, or millimetres where they are large. Depth is along the axis (all of these, ROS's
REP 118), or the length of the ray (some renderers and time-of-flight cameras).
"""

from __future__ import annotations

import io
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.clouds.cloud import MAX_POINTS, Cloud, cloud_of
from restore.formats.clouds.intrinsics import MM_PER_M, Intrinsics, files_named, intrinsics_in, read_intrinsics
from restore.formats.parsing.picture import SUFFIXES, read_image
from restore.formats.parsing.source import CUT_SHORT, DAMAGED, is_file, read_bytes
from restore.formats.parsing.unit import AUTO, unit_mm
from restore.numerics.units import ASSUMED, BY_FORMAT, GIVEN, MAX_COORDINATE_MM
from restore.scan import Bytes, Floats

DEPTHS = (".png", ".tif", ".tiff", ".exr")
COLOURS = ("color", "colour", "rgb", "image", "texture", "bgr")
MODES = ("I;16", "I;16B", "I;16L", "I", "F", "L")  # Pillow's names: 16 bits, 32 bits, single precision, 8 bits
FAR_M = 20.0  # depths of a page in metres are smaller, in millimetres larger
AXIS, RAY = "axis", "ray"
ASK = "give --depth axis for depths along the camera's axis, or --depth ray for lengths of the rays"
ONE = "keep one depth image in its folder, or give the file itself"


def check_depth(depth: str) -> None:
    """Raise BadInput for another kind of depth than AXIS, RAY and AUTO."""
    if depth not in (AXIS, RAY, AUTO):
        raise BadInput(f"{depth!r} is not a kind of depth", ASK)


def is_depth_folder(folder: Path) -> bool:
    """Whether a folder holds a depth image and intrinsics."""
    return bool(files_named(folder, DEPTHS, ("depth",))) and intrinsics_in(folder) is not None


def read_depth(path: Path, unit: str = AUTO, depth: str = AUTO) -> Cloud:
    """Read a depth image, or the one of a folder, in millimetres.

    unit: of a step of its numbers. depth: `axis`, `ray`, or `auto`.
    Raises BadInput, also where the file leaves open which depth it has.
    """
    image = path if is_file(path) else _only_image(path)
    folder = image.parent
    intrinsics = intrinsics_in(folder)
    if intrinsics is None:
        raise BadInput(f"{path}: its folder has no intrinsics", "put intrinsics.json with fx, fy, cx and cy next to it")
    camera = read_intrinsics(intrinsics)
    numbers, whole = _numbers(image)
    rows, cols = numbers.shape
    if camera.size not in (None, (cols, rows)):
        raise BadInput(f"{image} has {cols} × {rows} pixels, its intrinsics are of {camera.size}", "give its own")
    along = {AXIS: True, RAY: False}.get(depth, camera.along_axis)
    if along is None:
        raise BadInput(f"{image}: whether its depths are along the axis is not stated", ASK)
    step, source = _step(numbers, whole, camera, unit)
    with np.errstate(over="ignore", invalid="ignore"):
        z = np.where((numbers > 0) & (numbers * step < MAX_COORDINATE_MM), numbers * step, np.nan)
    rays = camera.rays(rows, cols)
    z = z if along else z / np.sqrt(1.0 + (rays**2).sum(axis=2))
    points = np.dstack([rays * z[..., None], z]).reshape(-1, 3)
    cloud = replace(cloud_of(image, points), size=(cols, rows))
    facts = {**cloud.provenance, "unit": f"{step:g}mm", "unit_source": source, "depth": AXIS if along else RAY}
    assumed = (Finding.of("depth_step_assumed"),) if whole and source == ASSUMED else ()
    picture = _colour(folder, image, camera, points, rows, cols)
    return replace(cloud, provenance=facts, picture=picture, findings=assumed)


def _only_image(folder: Path) -> Path:
    found = files_named(folder, DEPTHS, ("depth",))
    if len(found) != 1:
        raise BadInput(f"{folder} holds {len(found)} depth images", ONE)
    return found[0]


def _numbers(path: Path) -> tuple[Floats, bool]:
    """Return the numbers (rows, cols) of a picture of one channel, and whether they are whole."""
    if path.suffix.lower() == ".exr":
        raise BadInput(f"{path}: EXR is not read", "save the depths as TIFF in single precision")
    data = read_bytes(path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow warns of odd tags; unreadable pixels are an error all the same
        try:
            with Image.open(io.BytesIO(data), formats=("PNG", "TIFF")) as picture:
                if picture.width * picture.height > min(MAX_POINTS, 64 * len(data) + 2**20):
                    raise BadInput(f"{path} has too many pixels: {picture.width} × {picture.height}", DAMAGED)
                if picture.mode not in MODES:
                    raise BadInput(f"{path} has pixels of the kind {picture.mode}", "save one channel of 16 bits")
                return np.asarray(picture, np.float64), picture.mode != "F"
        except BadInput:
            raise
        except Exception as error:  # Pillow's decoders raise whatever they trip over
            raise BadInput(f"{path} is not a whole depth image: {error}", CUT_SHORT) from error


def _step(numbers: Floats, whole: bool, camera: Intrinsics, unit: str) -> tuple[float, str]:
    """Return the millimetres of a step and where they come from."""
    given = None if unit == AUTO else unit_mm(unit)
    if given is not None:
        return given, GIVEN
    if whole:
        return (1.0, ASSUMED) if camera.step_mm is None else (camera.step_mm, BY_FORMAT)
    known = numbers[np.isfinite(numbers) & (numbers > 0)]
    return (MM_PER_M if len(known) and np.median(known) < FAR_M else 1.0), ASSUMED


def _colour(
    folder: Path, image: Path, camera: Intrinsics, points: Floats, rows: int, cols: int
) -> tuple[Bytes, Floats] | None:
    """Return the colour image with the positions (n, 2) of the points in it."""
    found = [path for path in files_named(folder, SUFFIXES, COLOURS) if path != image]
    if not found:
        return None
    picture = read_image(found[0])
    height, width = picture.shape[:2]
    if camera.colour is None:
        if abs(width * rows - height * cols) > max(width, cols):
            raise BadInput(
                f"{found[0]} of {width} × {height} pixels does not fit a depth image of {cols} × {rows}",
                "register the colour image to the depth image, or add its camera and extrinsics to the intrinsics",
            )
        x, y = np.meshgrid((np.arange(cols) + 0.5) * width / cols - 0.5, (np.arange(rows) + 0.5) * height / rows - 0.5)
        return picture, np.stack([x.ravel(), y.ravel()], axis=1)
    other, rotation, shift = camera.colour
    places = other.pixels(points @ rotation.T + shift)
    return picture, np.where(np.isfinite(places), places, -1.0)

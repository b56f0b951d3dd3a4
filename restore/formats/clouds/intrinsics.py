"""Intrinsics of depth cameras, as their programs write them.

Open3D: JSON of `PinholeCameraIntrinsic` with `intrinsic_matrix`, column by column, and `width`, `height`
(open3d.org); `depth_scale` steps to the metre. RealSense: `ppx ppy fx fy`, `model`, `coeffs` k1 k2 p1 p2 k3 as of
`rs2_intrinsics`, `depth_scale` metres to the step. ROS: `camera_info` with K row by row and D, as
`sensor_msgs/CameraInfo` or as `camera_calibration_parsers` write it. TUM and others: text of fx fy cx cy, or nine or
sixteen numbers of a matrix. A pixel's centre has whole coordinates.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.source import DAMAGED, is_file, read_bytes
from restore.formats.ply_data import MAX_HEADER_BYTES
from restore.numerics.units import UNIT_MM
from restore.scan import Floats

SUFFIXES, NAMES = (".json", ".yaml", ".yml", ".txt"), ("intrinsic", "camera")
MM_PER_M = UNIT_MM["m"]
WRITE = "write fx, fy, cx and cy of the depth image as JSON, in pixels"
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LIST = r"\s*:\s*(?:\n?(?:[ \t]*(?:rows|cols)[^\n]*\n)*[ \t]*data\s*:)?\s*(\[[^\]]*\]|(?:\n[ \t]*-[^\n]*)+)"
FORWARD, INVERSE, FISHEYE = "forward", "inverse", "fisheye"
MODELS = {  # words in the names of distortion models
    "none": FORWARD,
    "plumb_bob": FORWARD,
    "rational": FORWARD,
    "inverse_brown_conrady": INVERSE,
    "brown_conrady": FORWARD,
    "equidistant": FISHEYE,
    "kannala": FISHEYE,
    "ftheta": FISHEYE,
}


@dataclass(frozen=True)
class Intrinsics:
    """A camera: focal lengths and centre in pixels, and the distortion of its lens.

    size       width and height, where stated.
    step_mm    of the numbers of the depth image, where stated.
    along_axis whether depths are along the axis or of the ray; None where the kind of file leaves it open.
    colour     the camera of the colour image, where it is another, with rotation (3, 3) and shift (3,) mm to its frame.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    size: tuple[int, int] | None = None
    model: str = FORWARD
    coefficients: tuple[float, ...] = ()
    step_mm: float | None = None
    along_axis: bool | None = None
    colour: tuple[Intrinsics, Floats, Floats] | None = None

    def rays(self, rows: int, cols: int) -> Floats:
        """Return the directions (rows, cols, 2) x/z and y/z of the pixels, y down."""
        col, row = np.meshgrid(np.arange(cols, dtype=float), np.arange(rows, dtype=float))
        x, y = (col - self.cx) / self.fx, (row - self.cy) / self.fy
        if not any(self.coefficients):
            return np.dstack([x, y])
        places = np.stack([x.ravel(), y.ravel()], axis=1)[:, None]
        none, d = np.eye(3), np.array(self.coefficients)
        if self.model == FISHEYE:
            straight = cv2.fisheye.undistortPoints(places, none, d[:4])
        elif self.model == INVERSE:
            straight = cv2.projectPoints(np.insert(places, 2, 1.0, axis=2), np.zeros(3), np.zeros(3), none, d)[0]
        else:
            straight = cv2.undistortPoints(places, none, d)
        return np.asarray(straight.reshape(rows, cols, 2), np.float64)

    def pixels(self, points: Floats) -> Floats:
        """Return the pixels (n, 2) of points (n, 3) of its own frame, y down and z forward."""
        with np.errstate(invalid="ignore", divide="ignore"):
            if not any(self.coefficients) or self.model == INVERSE:
                return points[:, :2] / points[:, 2:] * [self.fx, self.fy] + [self.cx, self.cy]
            matrix = np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1]])
            still, d = np.zeros(3), np.array(self.coefficients)
            project = cv2.fisheye.projectPoints if self.model == FISHEYE else cv2.projectPoints
            options = (still, still, matrix, d[:4] if self.model == FISHEYE else d)
            return np.asarray(project(np.ascontiguousarray(points[:, None]), *options)[0].reshape(-1, 2))


def intrinsics_in(folder: Path) -> Path | None:
    """Return the file of intrinsics in a folder, None without one."""
    found = [path for word in NAMES for path in files_named(folder, SUFFIXES, (word,))]
    return found[0] if found else None


def files_named(folder: Path, suffixes: tuple[str, ...], words: tuple[str, ...]) -> list[Path]:
    """Return the files of a folder with one of some suffixes and a word in their name."""
    try:
        files = sorted(path for path in folder.iterdir() if path.suffix.lower() in suffixes and is_file(path))
    except OSError:
        return []
    return [file for file in files if any(word in file.stem.lower() for word in words)]


def read_intrinsics(path: Path) -> Intrinsics:
    """Read the intrinsics of a file. Raises BadInput."""
    text = read_bytes(path, MAX_HEADER_BYTES).decode("utf-8-sig", "replace")
    try:
        if path.suffix.lower() == ".json":
            found = _of_json(json.loads(text))
        elif path.suffix.lower() in (".yaml", ".yml"):
            found = _of_ros(text)
        else:
            found = _of_numbers([float(word) for line in text.splitlines() for word in _words(line)])
    except (ValueError, TypeError, KeyError, IndexError, OverflowError, RecursionError) as error:
        raise BadInput(f"{path} does not hold the intrinsics of a camera: {error}", WRITE) from error
    numbers = found.fx, found.fy, found.cx, found.cy, *found.coefficients
    if not np.isfinite(numbers).all() or min(found.fx, found.fy) <= 0:
        raise BadInput(f"{path}: focal lengths of {found.fx:g} and {found.fy:g} pixels cannot be", DAMAGED)
    return found


def _words(line: str) -> list[str]:
    return _NUMBER.findall(line.split("#")[0])


def _of_json(content: Any) -> Intrinsics:
    tables = list(_tables(content))
    table = next((one for one in tables if _is_camera(one)), None)
    if table is None:
        raise ValueError("it names no focal length")
    camera = _camera(table)
    scale = next((float(one["depth_scale"]) for one in tables if one.get("depth_scale")), None)
    # Open3D counts steps to the metre, RealSense metres to the step.
    step = None if scale is None else MM_PER_M / scale if scale >= 1.0 else MM_PER_M * scale
    kind = next((str(one["depth"]) for one in tables if one.get("depth") in ("axis", "ray")), None)
    known = "intrinsic_matrix" in table or "ppx" in table or "K" in table or None
    along = known if kind is None else kind == "axis"
    return Intrinsics(**{**camera, "step_mm": step, "along_axis": along, "colour": _colour_camera(content)})


def _tables(content: Any) -> Iterator[Mapping[str, Any]]:
    """Yield the tables of a JSON value, those of depth first and those of colour last."""
    if isinstance(content, Mapping):
        yield content
        for key in sorted(content, key=lambda key: ("depth" not in key.lower(), "col" in key.lower())):
            yield from _tables(content[key])


def _is_camera(table: Mapping[str, Any]) -> bool:
    return "fx" in table or "intrinsic_matrix" in table or "K" in table or "camera_matrix" in table


def _camera(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a camera of one table."""
    size = None
    if "width" in table and "height" in table:
        size = int(table["width"]), int(table["height"])
    coefficients = table.get("coeffs") or table.get("D") or table.get("distortion") or ()
    model = str(table.get("model") or table.get("distortion_model") or "")
    lens = {"size": size, "coefficients": _floats(coefficients), "model": _model(model, _floats(coefficients))}
    if "fx" in table:
        centre = [float(table.get(a, table.get(b))) for a, b in (("ppx", "cx"), ("ppy", "cy"))]
        fx, fy = float(table["fx"]), float(table.get("fy", table["fx"]))
        return {"fx": fx, "fy": fy, "cx": centre[0], "cy": centre[1], **lens}
    matrix = next(table[key] for key in ("intrinsic_matrix", "K", "camera_matrix") if key in table)
    matrix = matrix.get("data", matrix) if isinstance(matrix, Mapping) else matrix
    return {**_matrix(_floats(matrix)), **lens}


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in np.asarray(values, np.float64).ravel())


def _matrix(numbers: tuple[float, ...]) -> dict[str, Any]:
    """Return focal lengths and centre of a matrix, row by row or column by column."""
    if len(numbers) not in (9, 12, 16):
        raise ValueError(f"a matrix of {len(numbers)} numbers")
    width = 3 if len(numbers) == 9 else 4
    if width == 3 and (numbers[6] or numbers[7]):
        return {"fx": numbers[0], "fy": numbers[4], "cx": numbers[6], "cy": numbers[7]}
    return {"fx": numbers[0], "fy": numbers[width + 1], "cx": numbers[2], "cy": numbers[width + 2]}


def _model(name: str, coefficients: tuple[float, ...]) -> str:
    word = next((word for word in MODELS if word in name.lower().replace("-", "_").replace(" ", "_")), None)
    if word is None and name and any(coefficients):
        raise ValueError(f"the distortion model {name[:40]!r} is not known")
    return MODELS.get(word or "none", FORWARD)


def _colour_camera(content: Any) -> tuple[Intrinsics, Floats, Floats] | None:
    """Return the unregistered colour image's camera with its pose, RealSense's `extrinsics`.

    Their rotation is stored column by column, their translation in metres.
    """
    if not isinstance(content, Mapping):
        return None
    camera, pose = (
        next((content[key] for key in keys if isinstance(content.get(key), Mapping)), None)
        for keys in (("color", "colour", "color_intrinsics"), ("extrinsics", "depth_to_color"))
    )
    if camera is None or pose is None:
        return None
    table = next(one for one in _tables(camera) if _is_camera(one))
    rotation = np.array(_floats(pose["rotation"])).reshape(3, 3).T
    shift = np.array(_floats(pose["translation"])).reshape(3) * MM_PER_M
    return Intrinsics(**_camera(table)), rotation, shift


def _of_ros(text: str) -> Intrinsics:
    matrix = next((values for key in ("camera_matrix", "K", "k") if (values := _listed(text, key))), None)
    if matrix is None:
        raise ValueError("it has no camera_matrix")
    coefficients = next((v for key in ("distortion_coefficients", "D", "d") if (v := _listed(text, key))), ())
    model = re.search(r"distortion_model\s*:\s*['\"]?([\w-]+)", text)
    sides = [re.search(rf"(?m)^\s*(?:image_)?{side}\s*:\s*(\d+)", text) for side in ("width", "height")]
    width, height = (int(side[1]) if side else 0 for side in sides)
    kind = _model(model[1] if model else "", coefficients)
    size = (width, height) if width and height else None
    lens: dict[str, Any] = {"size": size, "coefficients": coefficients, "model": kind}
    return Intrinsics(**_matrix(matrix), **lens, along_axis=True)


def _listed(text: str, key: str) -> tuple[float, ...]:
    found = re.search(rf"(?m)^[ \t]*{key}{_LIST}", text)
    return tuple(float(word) for word in _NUMBER.findall(found[1].replace("-\n", "\n"))) if found else ()


def _of_numbers(numbers: list[float]) -> Intrinsics:
    if len(numbers) in (9, 12, 16):
        return Intrinsics(**_matrix(tuple(numbers)), along_axis=True)
    if not 4 <= len(numbers) <= 9:
        raise ValueError(f"{len(numbers)} numbers")
    fx, fy, cx, cy, *coefficients = numbers
    return Intrinsics(fx, fy, cx, cy, coefficients=tuple(coefficients), along_axis=True)

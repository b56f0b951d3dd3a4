"""Calibration files of a camera with a projector.

OpenCV's FileStorage writes them: YAML, XML or JSON.

Names of the fields, in either of two ways:
cam_K, cam_kc, proj_K, proj_kc, R, T                                    scan3d-capture (Moreno & Taubin, 3DIMPVT 2012)
cam_int, cam_dist, proj_int, proj_dist, rotation, translation           procam-calibration
cam_size, proj_size   optional, Planish's own: width and height of the camera's pictures and of the projector's
Matrices are in pixels, the translation in millimetres, both as `cv2.stereoCalibrate` gives them with the camera first.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from restore.errors import BadInput
from restore.formats.parsing.source import DAMAGED, read_bytes
from restore.scan import Floats
from restore.structured_light import Lens, Projector, Rig

NAMES = (
    ("cam_K", "cam_kc", "proj_K", "proj_kc", "R", "T"),
    ("cam_int", "cam_dist", "proj_int", "proj_dist", "rotation", "translation"),
)
CAMERA_SIZE, PROJECTOR_SIZE = "cam_size", "proj_size"
MAX_BYTES = 2**20  # a page of numbers
MAX_NUMBERS = 64  # of a field
DISTORTIONS = (4, 5, 8, 12, 14)  # coefficients that OpenCV knows
ORTHONORMAL = 1e-3  # error of a rotation that was written as text, with four digits
RECALIBRATE = "give the file that the calibration wrote, with the fields " + ", ".join(NAMES[0])


def read_rig(path: Path, projector: Projector | None = None) -> Rig:
    """Read the rig of a calibration file.

    projector: its resolution, where it is known from elsewhere.
    Raises BadInput for a file without the fields, or whose numbers are not a camera, projector or rotation.
    """
    fields = _fields(path)
    names = next((names for names in NAMES if names[0] in fields), NAMES[0])
    missing = [name for name in names if name not in fields]
    if missing:
        raise BadInput(f"{path} has no {', '.join(missing)}", RECALIBRATE)
    camera_matrix, camera_distortion, lamp_matrix, lamp_distortion, rotation, shift = (fields[name] for name in names)
    if rotation.size != 9 or np.abs(rotation.reshape(3, 3) @ rotation.reshape(3, 3).T - np.eye(3)).max() > ORTHONORMAL:
        raise BadInput(f"{path}: {names[4]} is not a rotation (3 × 3)", RECALIBRATE)
    if shift.size != 3 or not np.any(shift):
        raise BadInput(f"{path}: {names[5]} is not a translation of three numbers", RECALIBRATE)
    return Rig(
        _lens(path, names[0], camera_matrix, camera_distortion),
        _lens(path, names[2], lamp_matrix, lamp_distortion),
        projector or _projector(path, fields),
        rotation.reshape(3, 3),
        shift,
        _size(path, CAMERA_SIZE, fields),
    )


def _lens(path: Path, name: str, matrix: Floats, distortion: Floats) -> Lens:
    is_camera = matrix.size == 9 and matrix[0] > 0 and matrix[4] > 0 and not np.any(matrix[[1, 3, 6, 7]])
    if not is_camera or matrix[8] != 1:
        raise BadInput(f"{path}: {name} is not a camera matrix [fx 0 cx; 0 fy cy; 0 0 1]", RECALIBRATE)
    if distortion.size not in DISTORTIONS:
        raise BadInput(f"{path}: {distortion.size} coefficients of distortion next to {name}", RECALIBRATE)
    return Lens(matrix.reshape(3, 3), distortion)


def _projector(path: Path, fields: dict[str, Floats]) -> Projector:
    size = _size(path, PROJECTOR_SIZE, fields)
    if size is None:
        raise BadInput(
            f"{path} does not say the resolution of the projector",
            f"put the patterns.json of `planish patterns` next to it, or add {PROJECTOR_SIZE}: [width, height]",
        )
    return Projector(*size)


def _size(path: Path, name: str, fields: dict[str, Floats]) -> tuple[int, int] | None:
    if name not in fields:
        return None
    size = fields[name]
    if size.size != 2 or not (size >= 1).all() or (size != np.rint(size)).any():
        raise BadInput(f"{path}: {name} is not a width and height", "write it as [width, height], in pixels")
    return int(size[0]), int(size[1])


def _fields(path: Path) -> dict[str, Floats]:
    """The fields of a file that are known, each as numbers (n,)."""
    known = {name for names in NAMES for name in names} | {CAMERA_SIZE, PROJECTOR_SIZE}
    text = read_bytes(path, MAX_BYTES)
    try:
        storage = cv2.FileStorage(text.decode("utf-8-sig"), cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        nodes = {name: storage.getNode(name) for name in known}
        fields = {name: _numbers(node) for name, node in nodes.items() if not node.empty()}
    except Exception as error:  # cv2.error, SystemError, UnicodeDecodeError: whatever its parser trips over
        raise BadInput(f"{path} cannot be read as a calibration of OpenCV", DAMAGED) from error
    wrong = [name for name, numbers in fields.items() if not np.isfinite(numbers).all()]
    if wrong:
        raise BadInput(f"{path}: {wrong[0]} holds a number that cannot be", DAMAGED)
    return fields


def _numbers(node: cv2.FileNode) -> Floats:
    """The numbers (n,) of a matrix, of a list, or of a list of lists."""
    if not node.isSeq():
        sides = [node.getNode(name).real() for name in ("rows", "cols")]
        listed = node.getNode("data").size()
        # OpenCV ends the process where a damaged matrix is larger than memory, or than its list of numbers.
        if node.getNode("dt").string() not in ("d", "f", "i") or not 0 < sides[0] * sides[1] == listed <= MAX_NUMBERS:
            raise ValueError("no matrix")
        matrix = node.mat()
        return np.asarray(matrix, np.float64).ravel()[: MAX_NUMBERS + 1]
    items = [node.at(k) for k in range(min(node.size(), MAX_NUMBERS))]
    return np.concatenate([_numbers(item) if item.isSeq() else [item.real()] for item in items] or [np.empty(0)])

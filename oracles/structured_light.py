"""A simulated camera and projector as a calibrated rig, and its captures as the folder that a user gives."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from oracles.simulation.camera import Camera
from oracles.simulation.projector import SimulatedRig
from restore.scan import Bytes, Floats, RangeScan
from restore.structured_light import Lens, Projector, Rig


def lens_of(camera: Camera) -> Lens:
    """The lens of a simulated camera or projector."""
    focal, (x, y), (k1, k2, k3) = camera.focal_px, camera.centre, camera.radial
    return Lens(np.array([[focal, 0, x], [0, focal, y], [0, 0, 1.0]]), np.array([k1, k2, *camera.tangential, k3]))


def rig_of(simulated: SimulatedRig) -> Rig:
    """The exact calibration of a simulated rig."""
    projector = Projector(*simulated.plan.projector)
    lenses = lens_of(simulated.camera), lens_of(simulated.projector)
    return Rig(*lenses, projector, simulated.rotation, simulated.shift, simulated.plan.size)


def captured(simulated: SimulatedRig, seed: int) -> list[Bytes]:
    """The pictures (h, w, 3) uint8 RGB of all patterns."""
    patterns = Projector(*simulated.plan.projector).patterns()
    return list(simulated.captures(patterns, np.random.default_rng(seed)))


def greys(pictures: Sequence[Bytes]) -> list[Bytes]:
    """Their brightness (h, w)."""
    return [cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for picture in pictures]


def fields_of(rig: Rig) -> dict[str, Floats]:
    """The fields of a calibration file, as scan3d-capture names them."""
    return {
        "cam_K": rig.camera.matrix,
        "cam_kc": rig.camera.distortion,
        "proj_K": rig.lamp.matrix,
        "proj_kc": rig.lamp.distortion,
        "R": rig.rotation,
        "T": rig.shift,
    }


def encode_calibration(fields: Mapping[str, Floats], suffix: str = ".yml") -> str:
    """A calibration file as OpenCV writes it."""
    storage = cv2.FileStorage(suffix, cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for name, matrix in fields.items():
        storage.write(name, np.atleast_2d(matrix))
    return str(storage.releaseAndGetString())


def write_captures(folder: Path, pictures: Sequence[Bytes], rig: Rig, *, suffix: str = ".png") -> None:
    """Write a folder of captures with its calibration and patterns.json."""
    for number, picture in enumerate(pictures):
        Image.fromarray(picture).save(folder / f"capture_{number}{suffix}", quality=95)
    (folder / "calibration.yml").write_text(encode_calibration(fields_of(rig)))
    (folder / "patterns.json").write_text(json.dumps({"projector": [rig.projector.width, rig.projector.height]}))


def depth_errors(scan: RangeScan, simulated: SimulatedRig) -> tuple[Floats, Floats]:
    """Errors (n,) mm of the depth of measured samples, and their true places (n, 2) mm on the page, NaN beside it."""
    points = scan.points[scan.measured] * [1.0, -1.0, -1.0]
    true, places = simulated.points(points[:, :2] / points[:, 2:])
    return points[:, 2] - true[:, 2], places

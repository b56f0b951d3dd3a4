"""The export "All data" of 3d Scanner App (Laan Labs).

Its fields are as public programs that read it have them.

textured_output.obj, or export.obj   the mesh, metres, in the frame of the cameras
frame_00000.jpg, frame_00000.json    a photograph and its camera: intrinsics, 9 numbers row by row; cameraPoseARFrame,
                                     16 numbers row by row, from the camera to the world; motionQuality, 0 to 1
More frames have a camera than a photograph.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image
from pydantic import BaseModel, ConfigDict, Field

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.obj import read_obj
from restore.formats.parsing.source import DAMAGED, is_file
from restore.phones.arkit import Frame, camera_of, world_to_mm
from restore.phones.detect import SCANNER_APP_FRAMES, SCANNER_APP_MESHES
from restore.phones.json_file import read_model
from restore.phones.polycam import NO_TEXTURE
from restore.scan import SurfaceMesh


class FrameFile(BaseModel):
    """The file of a frame."""

    model_config = ConfigDict(allow_inf_nan=False)
    intrinsics: list[float] = Field(min_length=9, max_length=9)
    pose: list[float] = Field(alias="cameraPoseARFrame", min_length=16, max_length=16)
    quality: float = Field(default=0.0, alias="motionQuality")


def read_mesh(folder: Path) -> SurfaceMesh:
    """The mesh in the frame of the cameras, mm, z up. Raises BadInput."""
    path = next(folder / name for name in SCANNER_APP_MESHES if is_file(folder / name))
    mesh = read_obj(path, NO_TEXTURE)
    return SurfaceMesh(world_to_mm(mesh.vertices), mesh.faces)


def read_frames(folder: Path) -> tuple[list[Frame], tuple[Finding, ...]]:
    """The photographs with their cameras, and findings. Raises BadInput."""
    frames = []
    for path in sorted(folder.glob(SCANNER_APP_FRAMES)):
        picture = path.with_suffix(".jpg")
        if is_file(picture):
            found = read_model(path, FrameFile)
            fx, _, cx, _, fy, cy, *_ = found.intrinsics
            camera = camera_of(path, np.array(found.pose).reshape(4, 4), (fx, fy, cx, cy), _size(picture))
            frames.append(Frame(picture, camera, found.quality))
    return frames, ()


def _size(path: Path) -> tuple[int, int]:
    try:
        with Image.open(path, formats=("JPEG",)) as picture:
            return picture.size
    except Exception as error:  # Pillow's decoders raise whatever they trip over
        raise BadInput(f"{path} is not a readable image", DAMAGED) from error

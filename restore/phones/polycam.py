"""Polycam's raw data export, as its own repository `polyform` documents it.

raw.glb          the mesh, metres, in an aligned frame
mesh_info.json   alignmentTransform: 16 numbers, column by column, from the frame of the cameras to that of the mesh
keyframes/images, keyframes/cameras                       NAME.jpg and NAME.json of each photograph
keyframes/corrected_images, keyframes/corrected_cameras   the same without distortion and with optimised poses
A camera's file has fx, fy, cx, cy, width, height, blur_score (less is more blurred) and the rows of its pose, t_00 to
t_23.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from restore.errors import BadInput
from restore.findings import Finding
from restore.formats.gltf.glb import read_glb
from restore.formats.parsing.source import DAMAGED, is_file, is_folder
from restore.phones.arkit import MM_PER_METRE, Frame, camera_of, world_to_mm
from restore.phones.json_file import read_model
from restore.scan import Bytes, Floats, SurfaceMesh

MESH, INFO = "raw.glb", "mesh_info.json"
CORRECTED = ("keyframes/corrected_images", "keyframes/corrected_cameras")
RAW = ("keyframes/images", "keyframes/cameras")
NO_TEXTURE: Bytes = np.zeros((1, 1, 3), np.uint8)  # the page is painted from the photographs


class CameraFile(BaseModel):
    """A camera's file."""

    model_config = ConfigDict(allow_inf_nan=False)
    fx: float
    fy: float
    cx: float
    cy: float
    width: int = Field(ge=64, le=16384)
    height: int = Field(ge=64, le=16384)
    blur_score: float = 0.0
    t_00: float
    t_01: float
    t_02: float
    t_03: float
    t_10: float
    t_11: float
    t_12: float
    t_13: float
    t_20: float
    t_21: float
    t_22: float
    t_23: float

    @property
    def pose(self) -> Floats:
        """Return the pose (4, 4) from the camera to the world."""
        rows = [[getattr(self, f"t_{row}{col}") for col in range(4)] for row in range(3)]
        return np.array([*rows, [0, 0, 0, 1]], np.float64)


class MeshInfo(BaseModel):
    """The part of mesh_info.json that is read."""

    model_config = ConfigDict(allow_inf_nan=False)
    alignment: list[float] = Field(alias="alignmentTransform", min_length=16, max_length=16)


def read_mesh(folder: Path) -> SurfaceMesh:
    """The mesh in the frame of the cameras, mm, z up. Raises BadInput."""
    if not is_file(folder / MESH):
        raise BadInput(f"{folder} has no {MESH}", "export the raw data of the capture, with its mesh")
    mesh = read_glb(folder / MESH, NO_TEXTURE)
    alignment = np.array(read_model(folder / INFO, MeshInfo).alignment).reshape(4, 4).T
    if abs(np.linalg.det(alignment)) < 1e-9 or np.any(alignment[3] != [0, 0, 0, 1]):
        raise BadInput(f"{folder / INFO}: alignmentTransform is not a motion", DAMAGED)
    back = np.linalg.inv(alignment)
    world = mesh.vertices @ back[:3, :3].T + back[:3, 3]
    if np.ptp(world, axis=0).max() > MM_PER_METRE:
        raise BadInput(f"{folder / MESH} is a kilometre large", "its unit is metres: export it again")
    return SurfaceMesh(world_to_mm(world), mesh.faces)


def read_frames(folder: Path) -> tuple[list[Frame], tuple[Finding, ...]]:
    """Read the photographs with their cameras, and findings.

    The cameras are the optimised ones where these exist. Raises BadInput.
    """
    optimised = all(is_folder(folder / part) for part in CORRECTED)
    images, cameras = (folder / part for part in (CORRECTED if optimised else RAW))
    frames = []
    for path in sorted(cameras.glob("*.json")):
        picture = images / f"{path.stem}.jpg"
        if is_file(picture):
            found = read_model(path, CameraFile)
            intrinsics = (found.fx, found.fy, found.cx, found.cy)
            camera = camera_of(path, found.pose, intrinsics, (found.width, found.height))
            frames.append(Frame(picture, camera, found.blur_score))
    return frames, () if optimised else (Finding.of("lens_unknown"),)

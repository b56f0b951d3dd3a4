"""Simulated photographs and a coarse mesh as the folders that scanning programs of phones export."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import trimesh

from drivers.simulated.scene.scene import Scene
from oracles.simulation.camera import Camera
from oracles.simulation.photographs import PhotographSet, encode_jpeg
from restore.phones.arkit import LENS, MM_PER_METRE, UPRIGHT
from restore.scan import Floats, Ints

# Any place and heading of the session's start: rotation about y (up), then metres.
HEADING_DEG, START_M = 37.0, np.array([0.4, -0.8, 1.1])
TABLE_MM = 60.0  # that the mesh holds round the page
ALIGNED_DEG = 21.0  # by which Polycam turns its mesh about y


def about_y(angle_deg: float) -> Floats:
    """(3, 3) rotation about y."""
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])


def to_arkit(points: Floats) -> Floats:
    """(n, 3) metres in ARKit's world of points (n, 3) mm of a simulated scene."""
    return points @ UPRIGHT / MM_PER_METRE @ about_y(HEADING_DEG).T + START_M


def pose_of(camera: Camera) -> Floats:
    """(4, 4) pose of a simulated camera as ARKit gives it."""
    pose = np.eye(4)
    pose[:3, :3] = about_y(HEADING_DEG) @ UPRIGHT.T @ camera.axes.T @ LENS
    pose[:3, 3] = to_arkit(camera.position[None])[0]
    return pose


def coarse_mesh(scene: Scene, spacing_mm: float, noise_mm: float, rng: np.random.Generator) -> tuple[Floats, Ints]:
    """Vertices (n, 3) mm and faces (m, 3) of page and table in one surface, as a phone's sensor gives it."""
    from drivers.simulated.imaging.raycast import RayCaster

    page = scene.vertices[np.unique(scene.faces[scene.on_page])]
    low, high = page[:, :2].min(axis=0) - TABLE_MM, page[:, :2].max(axis=0) + TABLE_MM
    x, y = (np.arange(low[k], high[k] + spacing_mm, spacing_mm) for k in (0, 1))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    top = page[:, 2].max() + 100.0
    _, reach = RayCaster(scene.vertices, scene.faces).first_hits(
        np.column_stack([places, np.full(len(places), top)]), np.tile([0.0, 0.0, -1.0], (len(places), 1))
    )
    vertices = np.column_stack([places, top - reach + noise_mm * rng.standard_normal(len(places))])
    corner = np.arange(len(places)).reshape(len(y), len(x))
    a, b, c, d = (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    quads = np.stack([a, b, c, d], axis=-1).reshape(-1, 4)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def write_polycam(folder: Path, taken: PhotographSet, mesh: tuple[Floats, Ints], *, corrected: bool = True) -> None:
    """Write the raw data export of Polycam. The photographs should have no distortion."""
    alignment = np.eye(4)
    alignment[:3, :3], alignment[:3, 3] = about_y(ALIGNED_DEG), [0.1, 0.2, -0.3]
    aligned = to_arkit(mesh[0]) @ alignment[:3, :3].T + alignment[:3, 3]
    folder.joinpath("raw.glb").write_bytes(trimesh.Trimesh(aligned, mesh[1], process=False).export(file_type="glb"))
    info = {"alignmentTransform": alignment.T.ravel().tolist(), "faceCount": len(mesh[1])}
    folder.joinpath("mesh_info.json").write_text(json.dumps(info))
    kinds = ["", "corrected_"] if corrected else [""]
    for kind in kinds:
        images, cameras = folder / "keyframes" / f"{kind}images", folder / "keyframes" / f"{kind}cameras"
        images.mkdir(parents=True)
        cameras.mkdir()
        for number, (image, camera) in enumerate(zip(taken.images, taken.cameras, strict=True)):
            name = str(1442008525605 + 250_000 * number)
            (images / f"{name}.jpg").write_bytes(encode_jpeg(image))
            pose = pose_of(camera)
            rows = {f"t_{row}{col}": float(pose[row, col]) for row in range(3) for col in range(4)}
            (x, y), (width, height) = camera.centre, camera.size
            fields = {"fx": camera.focal_px, "fy": camera.focal_px, "cx": x, "cy": y, "width": width, "height": height}
            (cameras / f"{name}.json").write_text(json.dumps({**fields, "blur_score": 100.0, **rows}))


def write_scanner_app(folder: Path, taken: PhotographSet, mesh: tuple[Floats, Ints]) -> None:
    """Write the export "All data" of 3d Scanner App. The photographs should have no distortion."""
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*point) for point in to_arkit(mesh[0])]
    lines += ["f {} {} {}".format(*face) for face in mesh[1] + 1]
    (folder / "textured_output.obj").write_text("\n".join(lines) + "\n")
    (folder / "info.json").write_text("{}")
    for number, (image, camera) in enumerate(zip(taken.images, taken.cameras, strict=True)):
        (folder / f"frame_{5 * number:05d}.jpg").write_bytes(encode_jpeg(image))
        for k in range(5):  # more cameras than photographs
            focal, (x, y) = camera.focal_px, camera.centre
            fields = {
                "cameraPoseARFrame": pose_of(camera).ravel().tolist(),
                "intrinsics": [focal, 0, x, 0, focal, y, 0, 0, 1],
                "motionQuality": 1,
                "frame_index": 5 * number + k,
            }
            (folder / f"frame_{5 * number + k:05d}.json").write_text(json.dumps(fields))

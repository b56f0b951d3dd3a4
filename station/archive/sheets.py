"""The measured sheets of a volume as meshes: GLB in metres, PLY and OBJ in millimetres."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np
import trimesh
from PIL import Image

from restore import RangeScan, SurfaceMesh
from restore.scan import Bytes, Floats, Ints, Mask
from station.images.png import encode_png
from station.page_files.mesh import encode_material, encode_warped, unit_square

METRES = 0.001  # to the millimetre; glTF 2.0, 3.1: "the units for all linear distances are meters"


def encode_sheet(mesh: SurfaceMesh, name: str) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a mesh, (name, content): GLB, PLY, OBJ with material and texture."""
    yield f"{name}.glb", encode_glb(mesh)
    yield f"{name}.ply", encode_ply(mesh)
    yield f"{name}.obj", encode_warped(mesh, f"{name}.mtl")
    if mesh.texture is not None and mesh.texcoords is not None:
        yield f"{name}.mtl", encode_material(f"{name}.png")
        yield f"{name}.png", encode_png(mesh.texture)


def encode_glb(mesh: SurfaceMesh) -> bytes:
    """The mesh as binary glTF 2.0, its texture inside."""
    visual = None
    if mesh.texture is not None and mesh.texcoords is not None:
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=Image.fromarray(mesh.texture), metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True
        )
        uv = unit_square(mesh.texcoords, *mesh.texture.shape[:2])
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    made = trimesh.Trimesh(mesh.vertices * METRES, mesh.faces, visual=visual, process=False)
    data: bytes = trimesh.Scene(made).export(file_type="glb")
    return data


def encode_ply(mesh: SurfaceMesh) -> bytes:
    """The mesh as binary PLY, mm; every vertex has the colour of its texture there."""
    fields = [("x", "<f8"), ("y", "<f8"), ("z", "<f8")]
    colours = _colours(mesh)
    fields += [] if colours is None else [(name, "u1") for name in ("red", "green", "blue")]
    vertices = np.zeros(len(mesh.vertices), dtype=fields)
    for axis, name in enumerate(("x", "y", "z")):
        vertices[name] = mesh.vertices[:, axis]
    if colours is not None:
        for channel, name in enumerate(("red", "green", "blue")):
            vertices[name] = colours[:, channel]
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    kinds = {"<f8": "double", "u1": "uchar"}
    out = io.BytesIO()
    out.write(f"ply\nformat binary_little_endian 1.0\ncomment unit mm\nelement vertex {len(vertices)}\n".encode())
    out.writelines(f"property {kinds[kind]} {name}\n".encode() for name, kind in fields)
    out.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n".encode())
    out.write(vertices.tobytes() + faces.tobytes())
    return out.getvalue()


def surface_of(scan: RangeScan | SurfaceMesh, within: Mask | None = None) -> SurfaceMesh:
    """Return the surface of a scan; of a range grid, triangles between measured neighbours.

    A cell with four samples is cut along its shorter diagonal.
    within: (rows, cols), the samples that count; all of them when None.
    """
    if isinstance(scan, SurfaceMesh):
        return scan
    measured = scan.measured if within is None else scan.measured & within
    index = np.full(measured.shape, -1, np.int64)
    index[measured] = np.arange(int(measured.sum()))
    faces = _triangles(scan.points, index)
    used = np.unique(faces)
    number = np.full(int(measured.sum()), -1, np.int64)
    number[used] = np.arange(len(used))
    vertices, texcoords = scan.points[measured][used], scan.texture_xy[measured][used]
    return SurfaceMesh(vertices, number[faces], texcoords, scan.texture, scan.provenance)


def _triangles(points: Floats, index: Ints) -> Ints:
    """Return triangles (m, 3) of a grid, counter-clockwise seen from +Z.

    index: (rows, cols), vertex numbers, −1 where missing.
    """
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    down = np.linalg.norm(points[:-1, :-1] - points[1:, 1:], axis=2)
    up = np.linalg.norm(points[:-1, 1:] - points[1:, :-1], axis=2)
    along = ~(down > up)  # NaN compares false: a cell of three samples has one triangle in either of the two cuts
    cuts = [(a, c, d, along), (a, d, b, along), (a, c, b, ~along), (b, c, d, ~along)]
    lone = [(a, c, b, along & (d < 0)), (b, c, d, along & (a < 0))]
    found = [np.stack([x[where], y[where], z[where]], axis=1) for x, y, z, where in (*cuts, *lone)]
    triangles = np.concatenate(found)
    return np.asarray(triangles[(triangles >= 0).all(axis=1)])


def _colours(mesh: SurfaceMesh) -> Bytes | None:
    """Return the nearest texture pixels' colours, (n, 3) uint8 RGB, None for a plain mesh."""
    if mesh.texture is None or mesh.texcoords is None:
        return None
    height, width = mesh.texture.shape[:2]
    x, y = np.rint(mesh.texcoords).astype(np.int64).T
    return np.asarray(mesh.texture[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)])

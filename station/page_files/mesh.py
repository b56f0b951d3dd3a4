"""Wavefront OBJ of the page, measured and flat; PLY of its strain.

The colour image is on both.
"""

from __future__ import annotations

import io

import numpy as np

from restore import FlatMesh, SurfaceMesh
from restore.drawing import average_at_vertices
from restore.scan import Floats


def encode_flat(mesh: FlatMesh, material_file: str) -> bytes:
    """The flat page as OBJ, mm, in the plane z = 0 with y up."""
    return _encode(np.column_stack([mesh.flat, np.zeros(len(mesh.flat))]), mesh, material_file)


def encode_warped(mesh: SurfaceMesh, material_file: str) -> bytes:
    """The page as it was measured as OBJ, mm, in the scanner's frame."""
    return _encode(mesh.vertices, mesh, material_file)


def encode_material(texture_file: str) -> bytes:
    """The MTL file that both meshes refer to."""
    return f"newmtl page\nKd 1 1 1\nmap_Kd {texture_file}\n".encode()


def encode_strain(mesh: FlatMesh) -> bytes:
    """The flat page as binary PLY, mm, with the stretch and shear at every vertex."""
    strain = average_at_vertices(mesh.face_strain, mesh.faces, len(mesh.flat))
    columns = [mesh.flat, np.zeros((len(mesh.flat), 1)), strain]
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.flat)}\n"
        + "".join(f"property double {name}\n" for name in ("x", "y", "z", "stretch", "shear"))
        + f"element face {len(mesh.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    return header.encode() + np.hstack(columns).astype("<f8").tobytes() + faces.tobytes()


def _encode(vertices: Floats, mesh: SurfaceMesh, material_file: str) -> bytes:
    out = io.BytesIO()
    painted = mesh.texcoords is not None and mesh.texture is not None
    if painted:
        out.write(f"mtllib {material_file}\nusemtl page\n".encode())
    np.savetxt(out, vertices, "v %.6f %.6f %.6f")
    if mesh.texcoords is not None and mesh.texture is not None:
        np.savetxt(out, unit_square(mesh.texcoords, *mesh.texture.shape[:2]), "vt %.8f %.8f")
    corners = mesh.faces + 1  # OBJ counts from 1
    if painted:
        np.savetxt(out, np.repeat(corners, 2, axis=1), "f %d/%d %d/%d %d/%d")
    else:
        np.savetxt(out, corners, "f %d %d %d")
    return out.getvalue()


def unit_square(pixels: Floats, height: int, width: int) -> Floats:
    """Convert texture pixels to texture coordinates.

    pixels: (n, 2). Returns (n, 2), 0 to 1 from edge to edge of the image, v upwards.
    """
    x, y = pixels.T
    return np.column_stack([(x + 0.5) / width, 1 - (y + 0.5) / height])

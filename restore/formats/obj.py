"""`.obj`: Wavefront text with its material file and picture. v points up in the picture."""

from __future__ import annotations

import re
from pathlib import Path

from restore.errors import BadInput
from restore.formats.foreign import parse
from restore.formats.mesh import surface, texture_uv
from restore.formats.picture import encode_png, read_picture
from restore.formats.source import MISSING, ONE_SHOT, beside, is_file, read_bytes
from restore.scan import Bytes, SurfaceMesh

_MTLLIB = re.compile(rb"^[ \t]*mtllib[ \t]+(.*?)[ \t]*\r?$", re.MULTILINE)
_USEMTL = re.compile(rb"^[ \t]*usemtl[ \t]+(.*?)[ \t]*\r?$", re.MULTILINE)
_MATERIAL = re.compile(rb"^[ \t]*(newmtl|map_Kd)[ \t]+(.*?)[ \t]*\r?$", re.MULTILINE)
# "-s 1 1 1" and the like, which may stand before the name of a picture.
_OPTIONS = re.compile(r"^(-[a-zA-Z]+( +(on|off|[-+.\deE]+))* +)+")


def read_obj(path: Path, texture: Bytes | None = None) -> SurfaceMesh:
    """Read a mesh with texture coordinates; `texture` replaces the picture of its material. Raises BadInput."""
    data = read_bytes(path)
    arrays = parse(path, data, "obj", skip_materials=True)
    if texture is None and arrays.uv is not None:
        texture = _picture(path, data)
    return surface(path, arrays.vertices, arrays.faces, uv=arrays.uv, texture=texture, colours=arrays.colours)


def write_obj(mesh: SurfaceMesh, path: Path) -> None:
    """Write a mesh, with 0.1 µm of resolution, and when it has a texture its .mtl and .png beside it."""
    lines = [f"mtllib {path.stem}.mtl", "usemtl page"] if mesh.texcoords is not None else []
    lines += map("v {:.4f} {:.4f} {:.4f}".format, *mesh.vertices.T)
    corner = "{0}"
    if mesh.texture is not None and mesh.texcoords is not None:
        lines += map("vt {:.7f} {:.7f}".format, *texture_uv(mesh.texcoords, mesh.texture).T)
        corner = "{0}/{0}"
        path.with_suffix(".mtl").write_text(f"newmtl page\nKd 1 1 1\nmap_Kd {path.stem}.png\n", encoding="utf-8")
        path.with_suffix(".png").write_bytes(encode_png(mesh.texture))
    face = "f " + " ".join(corner.replace("0", str(k)) for k in range(3))
    lines += map(face.format, *(mesh.faces + 1).T.tolist())
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _picture(path: Path, data: bytes) -> Bytes | None:
    """The picture of the materials that the faces use, None when no material names one."""
    pictures: dict[bytes, str] = {}
    for library in _MTLLIB.findall(data):
        name, text = _name(library), _material_file(path, _name(library))
        material = b""
        for key, value in _MATERIAL.findall(text):
            if key == b"newmtl":
                material = value
            else:
                pictures[material] = _OPTIONS.sub("", _name(value))
        if not text:
            raise BadInput(f"{path}: its material file {name!r} is empty", MISSING)
    used = set(_USEMTL.findall(data))
    names = {name for material, name in pictures.items() if material in used or not used}
    if len(names) > 1:
        raise BadInput(f"{path} uses {len(names)} pictures, a scan has one", ONE_SHOT)
    return _read(path, names.pop()) if names else None


def _material_file(path: Path, name: str) -> bytes:
    file = beside(path, name)
    if not is_file(file):
        raise BadInput(f"{path}: its material file {name!r} is missing", MISSING)
    return read_bytes(file)


def _read(path: Path, name: str) -> Bytes:
    file = beside(path, name)
    if not is_file(file):
        raise BadInput(f"{path}: its picture {name!r} is missing", MISSING)
    return read_picture(file)


def _name(value: bytes) -> str:
    return value.decode("utf-8", "replace")
